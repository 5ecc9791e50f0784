#include "core/base/light/light_mix.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/light/light_group.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"

namespace ls {
namespace {

using nlohmann::json;
using Factors = std::array<double, 3>;

bool is_factor(const json& value) {
  return value.is_number() && value.get<double>() >= 0 && value.get<double>() <= kMostMixFactor;
}

std::optional<Factors> factors(const json& value) {
  if (is_factor(value)) return Factors{value, value, value};
  if (!value.is_array() || value.size() != 3 || !std::ranges::all_of(value, is_factor)) return std::nullopt;
  return Factors{value[0], value[1], value[2]};
}

json written(const Factors& f) {
  if (f[0] == f[1] && f[1] == f[2]) return f[0];
  return f;
}

Result<LightMix> parse_json(std::string_view text) {
  const json parsed = json::parse(text, nullptr, false);
  if (!parsed.is_object())
    return bad_argument("a mix must be a JSON object of light groups and factors, as {\"key\": 2}");
  LightMix mix;
  for (const auto& [group, value] : parsed.items()) {
    if (const std::string wrong = wrong_light_group(group); !wrong.empty()) return bad_argument(wrong);
    GroupFactors& of = mix.groups[group];
    const auto refuse = [&, name = group] {
      return bad_argument(fmt::format(
          "the factor of the light group \"{}\" must be a number from 0 to {}, a list of three, or "
          "an object of \"surface\" and \"volume\" with such values",
          name, kMostMixFactor));
    };
    if (!value.is_object()) {
      const auto both = factors(value);
      if (!both) return refuse();
      of = {*both, *both};
      continue;
    }
    for (const auto& [part, part_value] : value.items()) {
      const auto one = factors(part_value);
      if (!one || (part != "surface" && part != "volume")) return refuse();
      (part == "surface" ? of.surface : of.volume) = *one;
    }
  }
  return mix;
}

Result<LightMix> parse_option(std::string_view text) {
  json groups = json::object();
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view item = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(item.size() + 1, rest.size()));
    const auto refuse = [&] {
      return bad_argument(
          fmt::format("'{}' is no factor of a light group: give GROUP=FACTOR or GROUP=R:G:B, for the light "
                      "of surfaces or "
                      "media alone GROUP.surface or GROUP.volume",
                      plain_text(item)));
    };
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos) return refuse();
    const std::string_view name = item.substr(0, equals), group = name.substr(0, name.find('.'));
    json value = json::array();
    for (std::string_view numbers = item.substr(equals + 1);;) {
      const std::size_t colon = numbers.find(':');
      const auto number = parse_number<double>(numbers.substr(0, colon));
      if (!number) return refuse();
      value.push_back(*number);
      if (colon == std::string_view::npos) break;
      numbers.remove_prefix(colon + 1);
    }
    if (value.size() != 1 && value.size() != 3) return refuse();
    if (value.size() == 1) value = json(value[0]);
    json& of = groups[std::string(group)];
    if (group == name) {
      if (!of.is_null())
        return bad_argument(fmt::format("the light group '{}' is given twice", plain_text(group)));
      of = std::move(value);
      continue;
    }
    const std::string part(name.substr(group.size() + 1));
    if (!of.is_null() && (!of.is_object() || of.contains(part)))
      return bad_argument(fmt::format("the light group '{}' is given twice", plain_text(group)));
    of[part] = std::move(value);
  }
  return parse_json(groups.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

Result<LightMix> parse_light_mix(std::string_view text) {
  return text.starts_with('{') ? parse_json(text) : parse_option(text);
}

std::string to_string(const LightMix& mix) {
  std::string out;
  const auto add = [&](const std::string& name, const Factors& f) {
    const bool grey = f[0] == f[1] && f[1] == f[2];
    out += fmt::format("{}{}={}", out.empty() ? "" : ",", name,
                       grey ? fmt::format("{}", f[0]) : fmt::format("{}", fmt::join(f, ":")));
  };
  for (const auto& [group, f] : mix.groups) {
    if (f.surface == f.volume) {
      add(group, f.surface);
      continue;
    }
    add(group + ".surface", f.surface);
    add(group + ".volume", f.volume);
  }
  return out;
}

std::string canonical_json(const LightMix& mix) {
  json out = json::object();
  for (const auto& [group, f] : mix.groups)
    out[group] = f.surface == f.volume ? written(f.surface)
                                       : json{{"surface", written(f.surface)}, {"volume", written(f.volume)}};
  return out.dump();
}

LightMix product(const LightMix& first, const LightMix& second) {
  LightMix out = first;
  for (const auto& [group, f] : second.groups) {
    GroupFactors& of = out.groups[group];
    for (std::size_t c = 0; c < 3; ++c) {
      of.surface[c] = std::min(of.surface[c] * f.surface[c], kMostMixFactor);
      of.volume[c] = std::min(of.volume[c] * f.volume[c], kMostMixFactor);
    }
  }
  return out;
}

}  // namespace ls
