// The integrators by their names in all versions of the dialect: what a scene may say, and --integrator.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace ls::scene {

// The one integrator whose settings say more than how far it goes.
inline constexpr std::string_view kDistantMis = "volpath_distant_mis";

struct IntegratorRow {
  std::string_view name;         // the dialect's, or ours
  std::string_view ours;         // IntegratorSettings::name
  std::optional<int> max_depth;  // that the name implies
  // Another way to the same answer, which is not gone here; a scene that asks for it is warned.
  bool other_method = false;
};

std::span<const IntegratorRow> integrators();
const IntegratorRow* integrator_row(std::string_view name);  // nullptr: there is none of that name

// False for `path` and those that become it. `name`: the dialect's, ours or Nori's; what is unknown sees
// them.
bool sees_media(std::string_view name);

// Integrators that do something besides, or differently, around a nested one, which is used alone.
struct WrapperRow {
  std::string_view name;
  std::string_view lost;  // what does not come of it
};
std::span<const WrapperRow> integrator_wrappers();
const WrapperRow* wrapper_row(std::string_view name);

}  // namespace ls::scene
