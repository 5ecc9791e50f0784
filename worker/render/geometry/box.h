// Boxes whose sides are parallel to the axes.
#pragma once

#include <algorithm>
#include <limits>

#include "worker/render/math/math.h"
#include "worker/render/math/transform.h"

namespace ls::render {

struct Box {
  V3d lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(lo.x <= hi.x); }
  void add(const V3d& p) { add({p, p}); }
  void add(const Box& b) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], b.lo[k]);
      hi[k] = std::max(hi[k], b.hi[k]);
    }
  }
  // The next three need a box that is not empty.
  V3d corner(int k) const { return {k & 1 ? hi.x : lo.x, k & 2 ? hi.y : lo.y, k & 4 ? hi.z : lo.z}; }
  // Returns the box around the image of this box under the map m.
  Box moved(const Affine& m) const {
    Box r;
    for (int k = 0; k < 8; ++k) r.add(m.point(corner(k)));
    return r;
  }
  Box grown(double by) const { return {lo - V3d(by), hi + V3d(by)}; }
};

}  // namespace ls::render
