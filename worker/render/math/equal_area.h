// The equal-area map between the unit square and the sphere (Clarberg 2008, "Fast Equal-Area Mapping of the
// (Hemi)Sphere using SIMD"), turned as in pbrt-v4: the square's centre is +z, its corners are -z, the middles
// of its right and its lower edge (1, 1/2) and (1/2, 1) are +x and +y.
//
// Derivation. For a place p in the square let s = 2 p - 1. In s, the hemisphere z > 0 is the diamond |s.x| +
// |s.y| < 1. In a quadrant of it let r = |s.x| + |s.y| and t = |s.y| / r: the area element ds.x ds.y is r dr
// dt. With the azimuth phi = t pi / 2 and z = 1 - r^2 the solid angle dz dphi is 2 r dr times pi / 2 dt. So
// the solid angle is pi times the area everywhere; the sphere has 4 pi and the square in s has 4. The
// hemisphere z < 0 is mirrored outwards across the diamond's edges: with a = |s.x| and b = |s.y|, the place
// (a, b) becomes (1 - b, 1 - a).
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/math/math.h"

namespace ls::render {

// The unit direction of a place in [0, 1]^2.
inline V3 equal_area_direction(const V2& place) {
  const float x = 2 * place.x - 1, y = 2 * place.y - 1;
  float a = std::abs(x), b = std::abs(y);
  const bool below = a + b > 1;
  if (below) {
    const float folded = 1 - b;
    b = 1 - a;
    a = folded;
  }
  const float r = a + b;
  const V2 circle = unit_circle(r > 0 ? .25f * b / r : 0);
  const float radius = r * safe_sqrt(2 - r * r), z = (1 - r) * (1 + r);
  return {std::copysign(circle.x * radius, x), std::copysign(circle.y * radius, y), below ? -z : z};
}

// The place in [0, 1]^2 of a unit direction. 1 - |z| is computed as (x^2 + y^2) / (1 + |z|), because the
// difference itself has few correct digits next to the poles.
inline V2 equal_area_place(const V3& d) {
  const float r = std::sqrt((d.x * d.x + d.y * d.y) / (1 + std::abs(d.z)));
  const float b = r * (std::atan2(std::abs(d.y), std::abs(d.x)) * (2 * kInvPi)), a = r - b;
  const bool below = d.z < 0;
  const float x = below ? 1 - b : a, y = below ? 1 - a : b;
  const auto share = [](float s, float sign) {
    return std::clamp(.5f + .5f * std::copysign(s, sign), 0.f, 1.f);
  };
  return {share(x, d.x), share(y, d.y)};
}

}  // namespace ls::render
