// Lists the counters of work_counters.h as pairs of name and count, for builds that count.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "worker/render/base/work_counters.h"

namespace ls::render {

using NamedCount = std::pair<const char*, std::uint64_t>;
inline std::array<NamedCount, 15> listed(const WorkCounters& w) {
  static_assert(sizeof(WorkCounters) == 15 * sizeof(std::uint64_t), "name the new counter here");
  return {{{"shadow_rays", w.shadow_rays},
           {"density", w.density},
           {"macro_cells", w.macro_cells},
           {"phase", w.phase},
           {"transmittance", w.transmittance},
           {"glow", w.medium_emission},
           {"equiangular", w.equiangular},
           {"boundary_rays", w.boundary_rays},
           {"veils", w.null_transmission},
           {"texels", w.texels},
           {"instances", w.instances},
           {"user_geometry", w.user_geometry},
           {"light_tree", w.light_tree},
           {"environment_map", w.environment_map},
           {"lens", w.lens}}};
}

}  // namespace ls::render
