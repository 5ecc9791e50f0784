#include "core/image/film/health.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

namespace ls {
namespace {

using nlohmann::json;

struct Row {
  HealthCause cause;
  std::string_view word;
  HealthEffect effect;
  std::string_view one, many;  // the text after the count, in singular and plural
};
constexpr auto kRejected = HealthEffect::rejected, kKept = HealthEffect::kept, kInput = HealthEffect::input;
constexpr std::array kRows{
    Row{HealthCause::none, "none", kKept, "", ""},
    Row{HealthCause::unnamed, "unnamed", kRejected, "sample was rejected for a cause that was not named",
        "samples were rejected for causes that were not named"},
    Row{HealthCause::not_a_number, "not_a_number", kRejected, "sample was not a number (NaN)",
        "samples were not a number (NaN)"},
    Row{HealthCause::infinite, "infinite", kRejected, "sample was infinite", "samples were infinite"},
    Row{HealthCause::too_large, "too_large", kRejected,
        "sample was brighter than 2^96, too bright to be added up",
        "samples were brighter than 2^96, too bright to be added up"},
    Row{HealthCause::too_many_surfaces, "too_many_surfaces", kRejected,
        "sample was cut off: its path had more than 1,048,576 rays, or a shadow ray of it crossed more than "
        "65,536 surfaces",
        "samples were cut off: their paths had more than 1,048,576 rays, or a shadow ray of them crossed "
        "more than 65,536 surfaces"},
    Row{HealthCause::no_direction, "no_direction", kRejected, "sample continued in an invalid direction",
        "samples continued in an invalid direction"},
    Row{HealthCause::nested_media, "nested_media", kRejected,
        "sample was inside of more than 32 boundaries of media at once",
        "samples were inside of more than 32 boundaries of media at once"},
    Row{HealthCause::negative, "negative", kKept, "sample was negative; it is kept",
        "samples were negative; they are kept"},
    Row{HealthCause::majorant_violation, "majorant_violation", kKept,
        "time a medium was denser than its bound, so the image may be biased",
        "times a medium was denser than its bound, so the image may be biased"},
    Row{HealthCause::negative_density, "negative_density", kInput,
        "negative value of a volume of the scene was made 0",
        "negative values of volumes of the scene were made 0"},
    Row{HealthCause::bright_albedo, "bright_albedo", kInput,
        "albedo of a volume of the scene was above 1 and counts as 1",
        "albedos of volumes of the scene were above 1 and count as 1"},
    Row{HealthCause::negative_texel, "negative_texel", kInput, "negative texel of the scene was made 0",
        "negative texels of the scene were made 0"},
    Row{HealthCause::reflectance, "reflectance", kInput,
        "colour of a material of the scene was not within 0 and 1 and was brought there",
        "colours of materials of the scene were not within 0 and 1 and were brought there"},
    Row{HealthCause::degenerate_triangle, "degenerate_triangle", kInput,
        "triangle of the scene without area was left out",
        "triangles of the scene without area were left out"},
    Row{HealthCause::wrong_texture_coordinates, "wrong_texture_coordinates", kInput,
        "face of a mesh has a wrong number of texture coordinates, and its mesh those of its vertices alone",
        "faces of meshes have a wrong number of texture coordinates, and their meshes those of their "
        "vertices "
        "alone"},
};
constexpr bool rows_in_order() {
  for (std::size_t i = 0; i < kRows.size(); ++i)
    if (static_cast<std::size_t>(kRows[i].cause) != i) return false;
  return true;
}
static_assert(kRows.size() == static_cast<std::size_t>(HealthCause::end_) && rows_in_order());

const Row& row(HealthCause cause) {
  const auto i = static_cast<std::size_t>(cause);
  return kRows[i < kRows.size() ? i : 0];
}

HealthCause cause_named(std::string_view word) {
  for (const Row& r : kRows)
    if (r.word == word && r.cause != HealthCause::none) return r.cause;
  return HealthCause::unnamed;
}

// Returns a + b, or the largest number if the sum overflows. Counts come from other processes, so they may
// have any value.
std::uint64_t sum(std::uint64_t a, std::uint64_t b) {
  return a > std::numeric_limits<std::uint64_t>::max() - b ? std::numeric_limits<std::uint64_t>::max()
                                                           : a + b;
}

std::string grouped(std::uint64_t n) {
  std::string s = fmt::format("{}", n);
  for (std::size_t i = s.size(); i > 3; i -= 3) s.insert(i - 3, ",");
  return s;
}

tl::unexpected<Error> bad_health(std::string_view what) {
  return bad_argument(fmt::format("health: {}", what));
}

Result<HealthLocation> location_from(const json& j) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<int>::max());
  const auto number = [&](std::size_t i) { return j[i].is_number_unsigned(); };
  if (!j.is_array() || j.size() != 3 || !number(0) || !number(1) || !number(2) ||
      j[0].get<std::uint64_t>() > kMost || j[1].get<std::uint64_t>() > kMost)
    return bad_health("a place must be [x, y, sample]");
  return HealthLocation{j[0].get<int>(), j[1].get<int>(), j[2].get<std::uint64_t>()};
}

}  // namespace

HealthEffect effect_of(HealthCause cause) { return row(cause).effect; }
std::string_view to_string(HealthCause cause) { return row(cause).word; }

std::string sentence(HealthCause cause, std::uint64_t count) {
  const Row& r = row(cause);
  std::string text = fmt::format("{} {}", grouped(count), count == 1 ? r.one : r.many);
  if (r.effect == HealthEffect::rejected) text += count == 1 ? "; it counts as zero" : "; they count as zero";
  return text;
}

void Health::add(HealthCause cause, std::uint64_t count) {
  if (count == 0 || cause == HealthCause::none) return;
  HealthEntry& entry = causes[cause];
  entry.count = sum(entry.count, count);
  if (effect_of(cause) == HealthEffect::rejected) nonfinite = sum(nonfinite, count);
  if (cause == HealthCause::negative) negative = sum(negative, count);
  if (cause == HealthCause::majorant_violation) majorant_violations = sum(majorant_violations, count);
}

void Health::add(HealthCause cause, std::uint64_t count, const HealthLocation& location) {
  if (count == 0 || cause == HealthCause::none) return;
  add(cause, count);
  auto& first = causes[cause].first;
  const auto at = std::lower_bound(first.begin(), first.end(), location);
  if (at == first.end() ? first.size() >= kHealthLocations : *at == location) return;
  first.insert(at, location);
  if (first.size() > kHealthLocations) first.pop_back();
}

void Health::merge(const Health& other) {
  for (const auto& [cause, entry] : other.causes) {
    if (effect_of(cause) == HealthEffect::input) {
      std::uint64_t& count = causes[cause].count;
      count = std::max(count, entry.count);
      continue;
    }
    add(cause, entry.count);
    auto& first = causes[cause].first;
    std::vector<HealthLocation> both;
    std::set_union(first.begin(), first.end(), entry.first.begin(), entry.first.end(),
                   std::back_inserter(both));
    both.resize(std::min(both.size(), kHealthLocations));
    first = std::move(both);
  }
}

std::string canonical_json(const Health& health) {
  json j = json::object();
  for (const auto& [cause, entry] : health.causes) {
    json locations = json::array();
    for (const HealthLocation& s : entry.first) locations.push_back({s.x, s.y, s.sample});
    j[std::string(to_string(cause))] = {{"count", entry.count}, {"first", std::move(locations)}};
  }
  return j.dump();
}

Result<Health> parse_health(std::string_view text) {
  constexpr std::size_t kMostBytes = 64 << 10, kMostCauses = 64;
  if (text.size() > kMostBytes) return bad_health("the text is too long");
  // The texts of canonical_json() have four levels of nesting. The callback discards deeper levels while the
  // text is parsed, so that a hostile text cannot use up the stack or the memory.
  bool deep = false;
  const auto shallow = [&](int depth, json::parse_event_t, json&) {
    deep = deep || depth > 4;
    return depth <= 4;
  };
  const json j = json::parse(text, shallow, false);
  if (deep || !j.is_object() || j.size() > kMostCauses) return bad_health("it must be an object of causes");
  Health health;
  for (const auto& [word, value] : j.items()) {
    const auto count = value.find("count"), first = value.find("first");
    if (!value.is_object() || count == value.end() || !count->is_number_unsigned() || first == value.end() ||
        !first->is_array() || first->size() > kHealthLocations)
      return bad_health("a cause must have its count and at most 8 places");
    Health one;
    const HealthCause cause = cause_named(word);
    one.add(cause, count->get<std::uint64_t>());
    if (one.clean()) continue;
    for (const json& place : *first) {
      const auto location = location_from(place);
      if (!location) return tl::unexpected(location.error());
      auto& list = one.causes[cause].first;
      if (!list.empty() && !(list.back() < *location)) return bad_health("places must ascend");
      list.push_back(*location);
    }
    health.merge(one);
  }
  return health;
}

Result<void> check_health(const Health& health, const PixelRect& rect, const SampleRange& samples) {
  const auto most = static_cast<std::uint64_t>(rect.pixels()) * samples.count();
  if (health.nonfinite > most || health.negative > most)
    return bad_health(
        fmt::format("{} rejected and {} negative samples of {}", health.nonfinite, health.negative, most));
  for (const auto& [cause, entry] : health.causes)
    for (const HealthLocation& s : entry.first)
      if (s.x < rect.x0 || s.x >= rect.x1 || s.y < rect.y0 || s.y >= rect.y1 || s.sample < samples.s0 ||
          s.sample >= samples.s1)
        return bad_health(fmt::format("pixel {},{} sample {} is not of this unit", s.x, s.y, s.sample));
  return {};
}

}  // namespace ls
