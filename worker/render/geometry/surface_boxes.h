// Computes the bounding boxes of a world's surfaces: one for each surface, or one for each of its instances
// if it is in a group.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct SurfaceBox {
  std::uint32_t surface = 0, instance = kNone;
  V3 lo, hi;

  // True if the boxes overlap or are closer to each other than 2^-18 of their largest coordinate.
  bool touches(const SurfaceBox& o) const {
    const float margin =
        0x1p-18f * std::max(std::max(largest(lo), largest(hi)), std::max(largest(o.lo), largest(o.hi)));
    return lo.x - margin <= o.hi.x && o.lo.x - margin <= hi.x && lo.y - margin <= o.hi.y &&
           o.lo.y - margin <= hi.y && lo.z - margin <= o.hi.z && o.lo.z - margin <= hi.z;
  }
};

// Returns the bounding boxes, in the world, of the surfaces for which `wanted` is true and that have
// primitives. Returns nullopt if instances make the list longer than 2^23 boxes.
std::optional<std::vector<SurfaceBox>> surface_boxes(const Geometry& g,
                                                     const std::function<bool(const SurfaceInfo&)>& wanted);

}  // namespace ls::render
