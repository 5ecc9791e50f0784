// The integrators by their names in all versions of the dialect (Mitsuba's scene format), for scenes and for
// --integrator.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace ls::scene {

// The only integrator with settings other than depths.
inline constexpr std::string_view kDistantMis = "volpath_distant_mis";

struct IntegratorRow {
  std::string_view name;         // the dialect's, or ours
  std::string_view ours;         // IntegratorSettings::name
  std::optional<int> max_depth;  // implied by the name
  // True if the name stands for another method with the same result that is not implemented here: scenes that
  // request it get a warning.
  bool other_method = false;
};

std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);  // nullptr: unknown name

// True if the integrator renders media, or is unknown; false for `path` and those that are read as `path`.
// `name` is the dialect's, ours or Nori's.
bool sees_media(std::string_view name);

// Integrators that contain another one and add something to its result; here the inner one is used alone.
struct WrapperRow {
  std::string_view name;
  std::string_view lost;  // the function that is lost
};
std::span<const WrapperRow> integrator_wrappers();
const WrapperRow* wrapper_row(std::string_view name);

}  // namespace ls::scene
