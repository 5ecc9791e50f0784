// Translates names of integrators: every name that a scene in any version of Mitsuba's format or the option
// --integrator may use has a row that gives Lightshaft's integrator. Also translates the names of the
// channels of Mitsuba's integrator "aov" and of Lightshaft's AOVs. In this file "ours" means Lightshaft's
// name.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

inline constexpr std::string_view kDistantMis = "volpath_distant_mis";
// Nori's integrator: it follows mirrors and clear glass to the first other surface and shows the direct light
// there. It ignores media.
inline constexpr std::string_view kWhitted = "whitted";

struct IntegratorRow {
  std::string_view name;         // a name in scenes: one of Mitsuba's integrators, or one of ours
  std::string_view ours;         // our integrator that renders it, as in IntegratorSettings::name
  std::optional<int> max_depth;  // maximum depth implied by the name ("direct": 2); nullopt: none
  // True if `name` is a method that we do not have (bdpt, ...) but whose image is the same. Our integrator
  // renders the scene instead, with a warning.
  bool other_method = false;
  int default_depth = -1;  // max_depth if neither the scene nor the name gives one; -1: no limit
};

std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);  // returns nullptr for an unknown name

// Returns whether the integrator renders media. `name` is Mitsuba's or ours. False for our `path` and
// `whitted` and for all names that are translated to one of them; true for an unknown name.
bool sees_media(std::string_view name);

// An integrator of Mitsuba that contains another one and adds something to its result. The inner integrator
// is rendered without the wrapper.
struct WrapperRow {
  std::string_view name;
  std::string_view lost;  // what the wrapper would have added, as the text of a warning
};
std::span<const WrapperRow> integrator_wrappers();
const WrapperRow* wrapper_row(std::string_view name);

// A channel of Mitsuba's integrator "aov" and the AOV (extra output image, core/image/aov/aov.h) that we
// render for it.
struct ChannelRow {
  std::string_view theirs, ours;  // `ours` is empty if the channel is not supported
  bool mitsuba = true;            // false: only Lightshaft has it; the command `convert` writes our name
};
std::span<const ChannelRow> channels();
const ChannelRow* channel_row(std::string_view theirs);  // returns nullptr for an unknown name

// Converts a list of our AOV names to the parameter `aovs` of Mitsuba's integrator "aov": "depth,normal"
// becomes "depth:depth,normal:sh_normal".
std::string mitsuba_channels(std::string_view aovs);

}  // namespace ls::scene
