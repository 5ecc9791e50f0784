// Computes the bounding boxes of spheres, disks and cylinders, exact up to rounding in double.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Box {
  V3d lo, hi;
};
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

}  // namespace ls::render
