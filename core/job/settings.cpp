#include "core/job/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/light/light_group.h"
#include "core/image/frame/rounds.h"
#include "core/job/describe.h"
#include "core/job/spec_draft.h"

namespace ls {
namespace job {
namespace {

constexpr std::string_view kLightGroups = "light_groups";

}  // namespace

// RenderSettings are made by the coordinator, and users do not see their names: the rows have no sentences.
template <class V, Of<RenderSettings> T>
void describe(V& v, T& s) {
  const auto row = [&](std::string_view name, auto& value, Range range = {}) {
    v.setting({.name = name, .range = range, .always = true}, value);
  };
  row("aov", s.aov);
  v.setting({.name = "deep", .range = {0, kMostDeepSlices}}, s.deep);
  v.setting({.name = "deep_alpha"}, s.deep_alpha);
  row("integrator", s.integrator);
  v.setting({.name = kLightGroups}, s.light_groups);
  v.setting({.name = "meters", .range = {0, kMaxMeters}}, s.meters);
  row("max_depth", s.max_depth, {-1, kMaxDepthSetting});
  row("rr_depth", s.rr_depth, {0, kMaxDepthSetting});
  row("seed", s.seed, {0, UINT64_MAX});
  row("size", s.size);
  row("tile", s.tile, {kMinTile, kMaxTile});
}

}  // namespace job

namespace {

using job::Json;
using job::kLightGroups;
using job::printable;

constexpr int kMaxNesting = 8;
constexpr std::string_view kRenderSettings = "render settings";

// Returns canonical JSON: nlohmann's objects are sorted by key, and dump(-1) writes no spaces.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

// Parses the text of a JSON object. Errors: other JSON values, duplicate keys, and texts that are too long or
// too deeply nested. `what` is the name of the text for messages, such as "spec".
Result<Json> parse_object(std::string_view text, std::string_view what) {
  if (text.size() > kMaxSpecBytes)
    return bad_argument(fmt::format("{}: {} bytes, the limit is {}", what, text.size(), kMaxSpecBytes));
  std::set<std::pair<int, std::string>> keys;
  std::optional<std::string> twice;
  bool too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    too_deep |= depth > kMaxNesting;
    // Once the text is too deep, values are discarded. Otherwise destroying or printing them, which is
    // recursive, could overflow the stack.
    if (too_deep) return false;
    if (event == Json::parse_event_t::key && depth <= 2) {
      const auto& key = parsed.get_ref<const std::string&>();
      if (!keys.emplace(depth, key).second && !twice) twice = key;
    } else if (event == Json::parse_event_t::object_end && depth == 1) {
      std::erase_if(keys, [](const auto& k) { return k.first == 2; });
    }
    return true;
  };
  try {
    auto json = Json::parse(text, watch);
    if (too_deep) return bad_argument(fmt::format("{}: nested deeper than {} levels", what, kMaxNesting));
    if (!json.is_object()) return bad_argument(fmt::format("{}: must be a JSON object {{...}}", what));
    if (twice)
      return bad_argument(fmt::format("{}: key '{}' is given twice", what, printable(*twice, kMaxNameBytes)));
    return json;
  } catch (const Json::exception& e) {
    return bad_argument(fmt::format("{}: not valid JSON: {}", what, printable(e.what(), 300)));
  }
}

Result<void> check_light_groups(const RenderSettings& settings, AovSet aovs) {
  const std::vector<std::string>& groups = settings.light_groups;
  const auto refuse = [](std::string_view why) {
    return bad_argument(fmt::format("{}: '{}' {}", kRenderSettings, kLightGroups, why));
  };
  for (const std::string& group : groups)
    if (const std::string wrong = wrong_light_group(group); !wrong.empty())
      return refuse("is not possible: " + wrong);
  if (std::ranges::adjacent_find(groups, std::ranges::greater_equal{}) != groups.end())
    return refuse("must be sorted, each name once");
  if (groups.size() > kMostLightGroups)
    return refuse(fmt::format("may have at most {} names", kMostLightGroups));
  if (groups.empty() == aovs.any_of(aovs_of(AovKind::groups)))
    return refuse("must be given with AOVs of light groups, and only then");
  return {};
}

}  // namespace

ImageForm form_of(const JobSpec& s) {
  return {s.float_output, s.colour_space, s.exr_compression, s.exr_parts};
}

std::string canonical_json(const RenderSettings& s) { return dump(job::write_object(s)); }

std::string_view to_string(TargetLayer layer) { return layer == TargetLayer::raw ? "raw" : "denoised"; }

std::optional<TargetLayer> parse_target_layer(std::string_view text) {
  for (const TargetLayer layer : {TargetLayer::raw, TargetLayer::denoised})
    if (to_string(layer) == text) return layer;
  return std::nullopt;
}

AovSet aovs_of(const RenderSettings& settings) {
  return parse_aovs(settings.aov)
      .value_or(AovSet{})
      .with_groups(settings.light_groups.size())
      .with_deep({static_cast<std::uint32_t>(settings.deep), settings.deep == 0 || !settings.deep_alpha});
}

Digest digest_of(const RenderSettings& settings) { return sha256(canonical_json(settings)); }

Result<RenderSettings> parse_render_settings(std::string_view text) {
  const auto json = parse_object(text, kRenderSettings);
  if (!json) return tl::unexpected(json.error());
  auto settings = job::read_object<RenderSettings>(*json, kRenderSettings);
  if (!settings) return settings;
  for (const std::string& key : job::names_of<RenderSettings>([](const job::Setting& s) { return s.always; }))
    if (!json->contains(key)) return bad_argument(fmt::format("{}: '{}' is missing", kRenderSettings, key));
  const auto aovs = parse_aovs(settings->aov);
  if (!aovs)
    return bad_argument(fmt::format("{}: 'aov' is not possible: {}", kRenderSettings, aovs.error().message));
  if (ls::names_of(*aovs) != settings->aov)
    return bad_argument(
        fmt::format("{}: 'aov' must be sorted, each name once, as it is called", kRenderSettings));
  if (auto ok = check_light_groups(*settings, *aovs); !ok) return tl::unexpected(ok.error());
  if (settings->deep_alpha && settings->deep == 0)
    return bad_argument(fmt::format("{}: 'deep_alpha' needs 'deep'", kRenderSettings));
  if (settings->deep > 0 && settings->meters > 0)
    return bad_argument(fmt::format("{}: there is no deep image of meters", kRenderSettings));
  return settings;
}

Result<void> check_film_size(const RenderSettings& s) {
  const AovSet aovs = aovs_of(s);
  const std::uint64_t film = film_bytes_per_pixel(aovs) * s.size.pixels();
  if (film > kMaxFilmBytes)
    return bad_argument(fmt::format(
        "{} x {} pixels with the AOVs {}{} take {} bytes each, {} in all; the limit is {}: ask for "
        "fewer AOVs{} or a smaller frame",
        s.size.width, s.size.height, fmt::join(s.aov, ", "),
        s.deep > 0 ? fmt::format("{} and {} slices of a deep image", s.aov.empty() ? "(none)" : "", s.deep)
                   : "",
        film_bytes_per_pixel(aovs), film, kMaxFilmBytes, s.deep > 0 ? ", fewer slices" : ""));
  return {};
}

Result<void> check_job_size(const RenderSettings& s, std::uint64_t spp) {
  if (auto ok = job::check_ranges(s, kRenderSettings); !ok) return ok;
  if (auto ok = job::check_ranges(JobSpec{.spp = spp}, "spec"); !ok) return ok;
  if (auto ok = check_film_size(s); !ok) return ok;
  const std::uint64_t tiles = grid_of(s).count(), units = tiles * round_count(spp);
  if (tiles > kMaxTiles || units > kMaxUnits)
    return bad_argument(
        fmt::format("{} x {} pixels in tiles of {} at {} samples are {} tiles and {} units of work; the "
                    "limits are {} and {}: "
                    "ask for fewer samples, a smaller frame or larger tiles",
                    s.size.width, s.size.height, s.tile, spp, tiles, units, kMaxTiles, kMaxUnits));
  return {};
}

std::string canonical_json(const JobSpec& spec) { return dump(job::write_object(spec)); }

Result<nlohmann::json> parse_spec_object(std::string_view text) { return parse_object(text, "spec"); }

Result<JobSpec> parse_job_spec(std::string_view text) {
  const auto json = parse_spec_object(text);
  return json ? job_spec_of(*json) : tl::unexpected(json.error());
}

Result<JobSpec> job_spec_of(const nlohmann::json& object) {
  job::SpecDraft draft(job::Form::json);
  if (auto ok = draft.add(object); !ok) return tl::unexpected(ok.error());
  return draft.finish();
}

}  // namespace ls
