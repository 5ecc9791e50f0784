#include "cli/output/job_options.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "common/base/parse_number.h"
#include "common/job/limits.h"

namespace ls::cli {
namespace {

// Parses two whole numbers with the character `between` between them, such as "640x360".
std::optional<std::pair<int, int>> two_numbers(std::string_view text, char between) {
  const auto at = text.find(between);
  if (at == std::string_view::npos) return std::nullopt;
  const auto first = parse_number<int>(text.substr(0, at)), second = parse_number<int>(text.substr(at + 1));
  if (!first || !second) return std::nullopt;
  return std::pair(*first, *second);
}

Result<TargetLayer> parse_layer(const std::string& text) {
  const auto layer = parse_target_layer(text);
  return layer ? Result<TargetLayer>(*layer)
               : bad_argument(fmt::format("--target-layer '{}': it must be raw or denoised", text));
}

Result<int> parse_priority(const std::string& text) {
  const auto value = parse_number<int>(text);
  if (!value || std::abs(std::int64_t{*value}) > kMaxPriority)
    return bad_argument(fmt::format("--priority '{}': it must be a whole number from -{} to {}", text,
                                    kMaxPriority, kMaxPriority));
  return *value;
}

}  // namespace

Result<std::uint64_t> parse_whole(const std::string& what, const std::string& text, std::uint64_t least,
                                  std::uint64_t most) {
  const auto value = parse_number<std::uint64_t>(text);
  if (!value || *value < least || *value > most)
    return bad_argument(
        fmt::format("{} '{}': it must be a whole number from {} to {}", what, text, least, most));
  return *value;
}

Result<std::uint32_t> parse_frame(const std::string& text) {
  const auto frame = parse_whole("--frame", text, 0, kMaxFrameNumber);
  if (!frame) return tl::unexpected(frame.error());
  return static_cast<std::uint32_t>(*frame);
}

Result<std::uint64_t> parse_bytes(const std::string& what, const std::string& text) {
  const std::string_view units = "KMGT";
  const std::size_t unit = text.empty() ? std::string_view::npos : units.find(text.back());
  const bool scaled = unit != std::string_view::npos;
  const auto value = parse_number<std::uint64_t>(scaled ? text.substr(0, text.size() - 1) : text);
  const int shift = scaled ? 10 * (static_cast<int>(unit) + 1) : 0;
  if (!value || *value == 0 || *value > kMaxMemory >> shift)
    return bad_argument(fmt::format("{} '{}': write it as bytes, or with K, M, G or T as 8G, at most {}T",
                                    what, text, kMaxMemory >> 40));
  return *value << shift;
}

Result<double> parse_positive(const std::string& what, const std::string& text, double most) {
  const auto value = parse_number<double>(text);
  if (!value || !std::isfinite(*value) || !(*value > 0) || *value > most)
    return bad_argument(
        fmt::format("{} '{}': it must be a number above 0, at most {:.9g}", what, text, most));
  return *value;
}

Result<FrameSize> parse_size(const std::string& text) {
  const auto size = two_numbers(text, 'x');
  if (!size) return bad_argument(fmt::format("--size '{}': write it as WIDTHxHEIGHT, 640x360 say", text));
  const auto [width, height] = *size;
  if (width < 1 || height < 1)
    return bad_argument(fmt::format("--size '{}': such an image has no pixels", text));
  if (width > kMaxFrameSide || height > kMaxFrameSide || std::int64_t{width} * height > kMaxFramePixels)
    return bad_argument(fmt::format("--size '{}': at most {} pixels a side and {} in all", text,
                                    kMaxFrameSide, kMaxFramePixels));
  return FrameSize{width, height};
}

Result<std::pair<int, int>> parse_pixel(const std::string& text) {
  const auto pixel = two_numbers(text, ',');
  if (!pixel || pixel->first < 0 || pixel->second < 0)
    return bad_argument(fmt::format("--pixel '{}': write it as X,Y, counted from 0 at the top left", text));
  return *pixel;
}

Result<std::map<std::string, std::string>> parse_defines(const std::vector<std::string>& defines) {
  std::map<std::string, std::string> values;
  for (const std::string& define : defines) {
    const auto equals = define.find('=');
    if (equals == std::string::npos || equals == 0)
      return bad_argument(fmt::format("-D '{}': write it as name=value", define));
    if (!values.emplace(define.substr(0, equals), define.substr(equals + 1)).second)
      return bad_argument(fmt::format("-D '{}': '{}' is given twice", define, define.substr(0, equals)));
  }
  if (values.size() > kMaxDefines) return bad_argument(fmt::format("-D: at most {} of them", kMaxDefines));
  return values;
}

void add_defines(CLI::App& app, std::vector<std::string>& defines) {
  add_option(app, "-D,--define", defines, "name=value", "sets the scene's $name")->allow_extra_args(false);
}

void JobOptions::add_to(CLI::App& app) {
  add_option(app, "--spp", spp, "N", "samples per pixel; default: the scene's");
  add_option(app, "--target-error", target_error, "E", "stop when the image's relMSE is below this");
  add_option(app, "--target-layer", target_layer, "LAYER",
             "whose relMSE --target-error means: raw, the image as rendered (default), or denoised, its "
             "denoised layers, which --denoise adds");
  add_option(app, "--time", time, "SECONDS", "stop after this many seconds, counted from the first ray");
  add_option(app, "--seed", seed, "N", "default 0");
  add_option(app, "--frames", frames, "A-B",
             "a sequence, 1-10 or 1-10x2 say: a run of # in the names of files is the frame's number, and "
             "$frame is it, too");
  add_option(app, "--size", size, "WxH", "size of the image instead of the scene's");
  add_option(app, "--integrator", integrator, "NAME",
             "volpath, volpath_distant_mis, path or whitted instead of the scene's");
  add_option(app, "--aov", aov, "NAME,...",
             "further layers of the image: " + known_aovs() + " (docs/reference/aovs.md)")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_defines(app, defines);
  app.add_flag("--float", float_output, "32-bit pixels in the image instead of half");
  app.add_flag("--denoise", denoise,
               "also the layers denoised.R, G, B, with their own error (needs Open Image Denoise: "
               "deploy/install-denoiser.sh)");
  app.add_flag("--strict", strict, "warnings of the scene are errors");
}

Result<JobSpec> JobOptions::parse() const {
  JobSpec spec;
  std::optional<int> priority_value;
  std::optional<std::uint64_t> workers, units;
  std::optional<TargetLayer> layer;
  for (const auto& taken :
       {take(spp, spec.spp, whole("--spp", 1, kMaxSpp)),
        take(target_error, spec.target_error, positive("--target-error", kMaxTargetError)),
        take(target_layer, layer, parse_layer), take(time, spec.time, positive("--time", kMaxSeconds)),
        take(seed, spec.seed, whole("--seed", 0, ~std::uint64_t{0})), take(size, spec.size, parse_size),
        take(priority, priority_value, parse_priority),
        take(max_workers, workers, whole("--max-workers", 1, kMaxAtOnce)),
        take(max_units, units, whole("--max-units", 1, kMaxAtOnce)),
        take(memory, spec.memory, [](const std::string& text) { return parse_bytes("--memory", text); })})
    if (!taken) return tl::unexpected(taken.error());
  if (!integrator.empty()) spec.integrator = integrator;
  if (!numeric_class.empty()) spec.numeric_class = numeric_class;
  auto values = parse_defines(defines);
  if (!values) return tl::unexpected(values.error());
  spec.defines = std::move(*values);
  if (!frames.empty()) {
    const auto range = parse_frames(frames);
    if (!range) return bad_argument("--" + range.error().message);
    spec.frames = *range;
    if (spec.defines.contains("frame"))
      return bad_argument("-D frame: with --frames the scene's $frame is the number of the frame");
  }
  if (const auto known = parse_aovs(aov); !known) return bad_argument("--aov: " + known.error().message);
  spec.aov = aov;
  spec.priority = priority_value.value_or(0);
  spec.float_output = float_output;
  spec.target_layer = layer.value_or(TargetLayer::raw);
  if (layer && !spec.target_error)
    return bad_argument("--target-layer says which error --target-error means: give that, too");
  spec.denoise = denoise || spec.target_layer == TargetLayer::denoised;
  spec.tags = tags;
  spec.after = after;
  if (workers) spec.max_workers = static_cast<std::uint32_t>(*workers);
  if (units) spec.max_units = static_cast<std::uint32_t>(*units);
  return spec;
}

}  // namespace ls::cli
