#include "common/job/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/image/frame/rounds.h"
#include "common/job/json_fields.h"
#include "common/job/limits.h"

namespace ls {
namespace {

using job::Fields;
using job::Json;

// Returns canonical JSON: nlohmann's objects are sorted by key, and dump(-1) writes no spaces.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json size_json(FrameSize size) { return Json::array({size.width, size.height}); }

void read_defines(Fields& fields, JobSpec& spec) {
  const Json* v = fields.find("defines");
  if (!v) return;
  if (!v->is_object() || v->size() > kMaxDefines)
    return fields.wrong("defines",
                        fmt::format("must be an object {{name: value}} of at most {} entries", kMaxDefines));
  for (const auto& item : v->items()) {
    const Json& value = item.value();
    if (!value.is_string() && !value.is_number() && !value.is_boolean())
      return fields.wrong("defines",
                          fmt::format("has a value for '{}' that is not a string, number or boolean",
                                      job::printable(item.key(), kMaxNameBytes)));
    const std::string text = value.is_string() ? value.get<std::string>() : dump(value);
    if (item.key().empty() || item.key().size() > kMaxNameBytes || text.size() > kMaxDefineBytes)
      return fields.wrong(
          "defines", fmt::format("has an entry whose name is empty or over {} bytes, or its value over {}",
                                 kMaxNameBytes, kMaxDefineBytes));
    spec.defines[item.key()] = text;
  }
}

// Reads the frames, written as a range such as "1-10" or as the number of a single frame.
void read_frames(Fields& fields, JobSpec& spec) {
  const Json* v = fields.find("frames");
  if (!v) return;
  if (!v->is_string() && !v->is_number_unsigned())
    return fields.wrong("frames", "must be a text like \"1-10\" or \"1-10x2\", or the number of one frame");
  const auto range = parse_frames(v->is_string() ? v->get<std::string>() : v->dump());
  if (!range) return fields.wrong("frames", "is not possible: " + range.error().message);
  spec.frames = *range;
  if (spec.defines.contains("frame"))
    fields.wrong("defines", "gives $frame, which in a job with 'frames' is the number of the frame");
}

// Reads `target_layer` and `denoise`. If `target_layer` is "denoised", the image must be denoised, so
// `denoise` is then true by default and must not be false.
void read_denoise(Fields& fields, JobSpec& spec) {
  const auto layer = fields.name("target_layer");
  if (layer) {
    const auto known = parse_target_layer(*layer);
    if (!known) return fields.wrong("target_layer", "must be \"raw\" or \"denoised\"");
    spec.target_layer = *known;
  }
  const bool needed = spec.target_layer == TargetLayer::denoised;
  spec.denoise = fields.boolean("denoise").value_or(needed);
  if (needed && !spec.denoise)
    fields.wrong("denoise", "is false, but target_layer is \"denoised\": leave it out, or set it to true");
}

void read_reference(Fields& fields, JobSpec& spec) {
  const Json* v = fields.find("reference");
  if (!v) return;
  spec.reference = v->is_string() ? Digest::parse(v->get_ref<const std::string&>()) : std::nullopt;
  if (!spec.reference)
    return fields.wrong("reference", "must be the SHA-256 of a blob, 64 hexadecimal digits");
  if (spec.frames && spec.frames->count() > 1)
    fields.wrong("reference", "is one image, and the job has several frames: submit them one by one");
}

}  // namespace

std::string canonical_json(const RenderSettings& s) {
  return dump(Json{{"aov", s.aov},
                   {"integrator", s.integrator},
                   {"max_depth", s.max_depth},
                   {"rr_depth", s.rr_depth},
                   {"seed", s.seed},
                   {"size", size_json(s.size)},
                   {"tile", s.tile}});
}

std::string_view to_string(TargetLayer layer) { return layer == TargetLayer::raw ? "raw" : "denoised"; }

std::optional<TargetLayer> parse_target_layer(std::string_view text) {
  for (const TargetLayer layer : {TargetLayer::raw, TargetLayer::denoised})
    if (to_string(layer) == text) return layer;
  return std::nullopt;
}

AovSet aovs_of(const RenderSettings& settings) { return parse_aovs(settings.aov).value_or(AovSet{}); }

Digest digest_of(const RenderSettings& settings) { return sha256(canonical_json(settings)); }

Result<RenderSettings> parse_render_settings(std::string_view text) {
  const auto json = job::parse_object(text, "render settings");
  if (!json) return tl::unexpected(json.error());
  const std::vector<std::string> keys = {"aov",  "integrator", "max_depth", "rr_depth",
                                         "seed", "size",       "tile"};
  Fields fields(*json, "render settings", keys);
  for (const auto& key : keys) fields.require(key.c_str());
  RenderSettings s;
  s.aov = fields.names("aov").value_or(s.aov);
  s.integrator = fields.name("integrator").value_or("");
  s.max_depth = static_cast<int>(fields.integer("max_depth", -1, kMaxDepthSetting).value_or(-1));
  s.rr_depth = static_cast<int>(fields.integer("rr_depth", 0, kMaxDepthSetting).value_or(5));
  s.seed = fields.whole("seed", 0, UINT64_MAX).value_or(0);
  s.size = fields.size("size").value_or(FrameSize{});
  s.tile = static_cast<int>(fields.whole("tile", kMinTile, kMaxTile).value_or(32));
  const auto aovs = parse_aovs(s.aov);
  if (!aovs) fields.wrong("aov", "is not possible: " + aovs.error().message);
  if (aovs && names_of(*aovs) != s.aov)
    fields.wrong("aov", "must be sorted, each name once, as it is called");
  if (fields.error()) return tl::unexpected(*fields.error());
  return s;
}

Result<void> check_job_size(const RenderSettings& s, std::uint64_t spp) {
  const auto pixels = static_cast<std::int64_t>(s.size.width) * s.size.height;
  if (s.size.width < 1 || s.size.height < 1 || s.size.width > kMaxFrameSide ||
      s.size.height > kMaxFrameSide || pixels > kMaxFramePixels)
    return bad_argument(
        fmt::format("the frame is {} x {} pixels; each side must be 1 to {}, and all together at most {}",
                    s.size.width, s.size.height, kMaxFrameSide, kMaxFramePixels));
  if (s.tile < kMinTile || s.tile > kMaxTile)
    return bad_argument(
        fmt::format("tiles of {} pixels; from {} to {} are possible", s.tile, kMinTile, kMaxTile));
  const AovSet aovs = aovs_of(s);
  const std::uint64_t film = film_bytes_per_pixel(aovs) * static_cast<std::uint64_t>(pixels);
  if (film > kMaxFilmBytes)
    return bad_argument(
        fmt::format("{} x {} pixels with the AOVs {} take {} bytes each, {} in all; the limit is {}: ask for "
                    "fewer AOVs or a smaller frame",
                    s.size.width, s.size.height, fmt::join(s.aov, ", "), film_bytes_per_pixel(aovs), film,
                    kMaxFilmBytes));
  if (spp < 1 || spp > kMaxSpp)
    return bad_argument(fmt::format("{} samples per pixel; from 1 to {} are possible", spp, kMaxSpp));
  const std::uint64_t tiles = TileGrid{s.size, s.tile}.count(), units = tiles * round_count(spp);
  if (tiles > kMaxTiles || units > kMaxUnits)
    return bad_argument(
        fmt::format("{} x {} pixels in tiles of {} at {} samples are {} tiles and {} units of work; the "
                    "limits are {} and {}: "
                    "ask for fewer samples, a smaller frame or larger tiles",
                    s.size.width, s.size.height, s.tile, spp, tiles, units, kMaxTiles, kMaxUnits));
  return {};
}

std::string canonical_json(const JobSpec& spec) {
  Json json{{"aov", spec.aov},
            {"defines", spec.defines},
            {"float", spec.float_output},
            {"priority", spec.priority},
            {"tags", spec.tags}};
  if (spec.denoise) json["denoise"] = true;
  if (spec.spp) json["spp"] = *spec.spp;
  if (spec.target_error) json["target_error"] = *spec.target_error;
  if (spec.target_layer != TargetLayer::raw) json["target_layer"] = to_string(spec.target_layer);
  if (spec.time) json["time"] = *spec.time;
  if (spec.seed) json["seed"] = *spec.seed;
  if (spec.size) json["size"] = size_json(*spec.size);
  if (spec.integrator) json["integrator"] = *spec.integrator;
  if (spec.frames) json["frames"] = to_string(*spec.frames);
  if (spec.max_workers) json["max_workers"] = *spec.max_workers;
  if (spec.max_units) json["max_units"] = *spec.max_units;
  if (spec.memory) json["memory"] = *spec.memory;
  if (spec.numeric_class) json["numeric_class"] = *spec.numeric_class;
  if (!spec.after.empty()) json["after"] = spec.after;
  if (spec.reference) json["reference"] = spec.reference->hex();
  return dump(json);
}

Result<nlohmann::json> parse_spec_object(std::string_view text) { return job::parse_object(text, "spec"); }

Result<JobSpec> parse_job_spec(std::string_view text) {
  const auto json = parse_spec_object(text);
  return json ? job_spec_of(*json) : tl::unexpected(json.error());
}

Result<JobSpec> job_spec_of(const nlohmann::json& object) {
  if (!object.is_object()) return bad_argument("spec: must be a JSON object {...}");
  Fields fields(object, "spec", {"spp",       "target_error", "target_layer",  "time",    "seed",
                                 "size",      "integrator",   "aov",           "defines", "priority",
                                 "float",     "denoise",      "tags",          "frames",  "max_workers",
                                 "max_units", "memory",       "numeric_class", "after",   "reference"});
  JobSpec spec;
  spec.spp = fields.whole("spp", 1, kMaxSpp);
  spec.target_error = fields.positive("target_error", kMaxTargetError);
  spec.time = fields.positive("time", kMaxSeconds);
  spec.seed = fields.whole("seed", 0, UINT64_MAX);
  spec.size = fields.size("size");
  spec.integrator = fields.name("integrator");
  spec.aov = fields.names("aov").value_or(spec.aov);
  read_defines(fields, spec);
  spec.priority = static_cast<int>(fields.integer("priority", -kMaxPriority, kMaxPriority).value_or(0));
  spec.float_output = fields.boolean("float").value_or(false);
  read_denoise(fields, spec);
  spec.tags = fields.names("tags").value_or(spec.tags);
  read_frames(fields, spec);
  const auto some = [&](const char* key) -> std::optional<std::uint32_t> {
    const auto value = fields.whole(key, 1, kMaxAtOnce);
    return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
  };
  spec.max_workers = some("max_workers");
  spec.max_units = some("max_units");
  spec.memory = fields.whole("memory", 1, kMaxMemory);
  spec.numeric_class = fields.name("numeric_class");
  spec.after = fields.names("after").value_or(spec.after);
  read_reference(fields, spec);
  if (fields.error()) return tl::unexpected(*fields.error());
  return spec;
}

}  // namespace ls
