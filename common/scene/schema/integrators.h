// The integrators by their names in all versions of Mitsuba's format, for scenes and for --integrator, and
// the channels of the integrator "aov".
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

inline constexpr std::string_view kDistantMis = "volpath_distant_mis";
// Nori's integrator: direct light at the first surface that is neither a mirror nor clear glass, without
// media.
inline constexpr std::string_view kWhitted = "whitted";

struct IntegratorRow {
  std::string_view name;         // Mitsuba's name, or ours
  std::string_view ours;         // IntegratorSettings::name
  std::optional<int> max_depth;  // maximum depth implied by the name
  // True if the name belongs to another method that computes the same picture. `ours` renders it instead, and
  // the scene gets a warning.
  bool other_method = false;
  int default_depth = -1;  // max_depth if the scene gives none
};

std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);  // returns nullptr for an unknown name

// True if the integrator renders media, or is unknown; false for `path`, `whitted` and those that are read as
// one of them. `name` is Mitsuba's, ours or Nori's.
bool sees_media(std::string_view name);

// Integrators that contain another one and add something to its result; here the inner one is used alone.
struct WrapperRow {
  std::string_view name;
  std::string_view lost;  // the function of the wrapper, which is not available here
};
std::span<const WrapperRow> integrator_wrappers();
const WrapperRow* wrapper_row(std::string_view name);

// A channel of Mitsuba's integrator "aov", and our AOV name (common/image/aov/aov.h).
struct ChannelRow {
  std::string_view theirs, ours;  // `ours` is empty if the channel is not supported
  bool mitsuba = true;            // false: Mitsuba has no such channel, and `convert` writes our name
};
std::span<const ChannelRow> channels();
const ChannelRow* channel_row(std::string_view theirs);  // returns nullptr for an unknown name

// Converts a list of our names to channels of Mitsuba: "depth,normal" becomes "depth:depth,normal:sh_normal".
std::string mitsuba_channels(std::string_view aovs);

}  // namespace ls::scene
