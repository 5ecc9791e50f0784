// The point on a light about which segments are sampled equi-angularly, and the cone into which it emits.
#pragma once

#include "worker/render/math/math.h"

namespace ls::render {

struct Pivot {
  V3 p;
  // Light leaves p only in directions whose cosine to the axis, a unit vector, is at least cos_reach. -1: in
  // all directions.
  V3 axis{0, 0, 0};
  float cos_reach = -1;

  Pivot(const V3& point) : p(point) {}
  Pivot(const V3& point, const V3& towards, float cosine) : p(point), axis(towards), cos_reach(cosine) {}
};

}  // namespace ls::render
