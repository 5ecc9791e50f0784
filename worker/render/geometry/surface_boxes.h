// Bounding boxes: of shapes, and of the surfaces of a world.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "worker/render/geometry/box.h"
#include "worker/render/geometry/geometry.h"

namespace ls::render {

// The boxes of shapes are exact up to rounding in double.
inline Box box_of(const Sphere& s) { return {s.center - V3d(s.radius), s.center + V3d(s.radius)}; }
inline V3d reach(const V3d& u, const V3d& v) {  // half extent of the ellipse u cos a + v sin a
  V3d r;
  for (int k = 0; k < 3; ++k) r[k] = std::sqrt(u[k] * u[k] + v[k] * v[k]);
  return r;
}
inline Box box_of(const Disk& s) {
  const V3d r = reach(s.u, s.v);
  return {s.center - r, s.center + r};
}
inline Box box_of(const Cylinder& s) {
  const V3d r = reach(s.u, s.v) * s.radius, end = s.p0 + s.axis * s.length;
  Box b;
  for (int k = 0; k < 3; ++k) {
    b.lo[k] = std::min(s.p0[k], end[k]) - r[k];
    b.hi[k] = std::max(s.p0[k], end[k]) + r[k];
  }
  return b;
}

// The box of a surface, or of one instance of it if the surface is in a group.
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

// Returns the bounding boxes, in the world and over the whole exposure, of the surfaces for which `wanted` is
// true and that have primitives. Returns nullopt if instances make the list longer than 2^23 boxes.
std::optional<std::vector<SurfaceBox>> surface_boxes(const Geometry& g,
                                                     const std::function<bool(const SurfaceInfo&)>& wanted);

}  // namespace ls::render
