// The meters of a scene without their places, which the coordinator does not need.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace ls {

// The meters of one sensor of the scene.
struct MeterGroup {
  std::string name;
  MeterKind kind = MeterKind::irradiance;
  std::uint32_t count = 1;  // number of points; 1 for a shape
  bool operator==(const MeterGroup&) const = default;
  // Returns the name of meter number `i` of the group: NAME, or NAME[1], NAME[2], ... in a list of points.
  std::string name_of(std::uint32_t i) const;
};
// Returns the groups in the order of the scene's meters. Their counts add up to RenderSettings::meters.
std::vector<MeterGroup> meter_groups(const Scene& scene);

}  // namespace ls
