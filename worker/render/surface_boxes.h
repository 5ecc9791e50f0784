// Boxes about the surfaces of a world, once for every instance.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "worker/render/geometry.h"

namespace ls::render {

struct SurfaceBox {
  std::uint32_t surface = 0, instance = kNone;
  V3 lo, hi;

  // Of the last places, too.
  bool touches(const SurfaceBox& o) const {
    const float margin =
        0x1p-18f * std::max(std::max(largest(lo), largest(hi)), std::max(largest(o.lo), largest(o.hi)));
    return lo.x - margin <= o.hi.x && o.lo.x - margin <= hi.x && lo.y - margin <= o.hi.y &&
           o.lo.y - margin <= hi.y && lo.z - margin <= o.hi.z && o.lo.z - margin <= hi.z;
  }
};

// Of those that are wanted and have any primitives, in the world. Nothing where instances make more of them
// than a list can be worth.
std::optional<std::vector<SurfaceBox>> surface_boxes(const Geometry& g,
                                                     const std::function<bool(const SurfaceInfo&)>& wanted);

}  // namespace ls::render
