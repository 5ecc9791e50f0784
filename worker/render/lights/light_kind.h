// The common part of all kinds of lights. Each kind is a struct in the file of its family (area.h,
// punctual.h, distant.h) with these members:
//
//   bool dark(world)                        true if the light emits nothing; the list of lights then omits it
//   double power(world)                     the flux; the probability of choosing the light follows from it
//   LightBounds bounds(world)               bounds for light_tree.h; only for lights with a position
//   V3 or Pivot pivot(world, numbers)       point about which segments of paths are sampled (lights.h);
//                                           only for lights with a position
//   optional<LightSample> sample(world, numbers, x, p)
//                                           samples the light that arrives at x; p is the probability with
//                                           which this light was chosen
//
// Kinds that correspond to an emitter of the scene format also have a make_light(), which converts it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/scene/scene.h"
#include "worker/render/base/kinds.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/light_tree.h"
#include "worker/render/math/math.h"
#include "worker/render/math/random.h"
#include "worker/render/math/transform.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

struct LightSample {
  V3 direction;        // unit, from the shaded point towards the light
  float distance = 0;  // distance to the light in that direction; infinity for distant lights
  // The point sampled on the light, moved off its surface: shadow rays end there. Not set for distant lights.
  V3 target{0, 0, 0};
  // The radiance that arrives if nothing blocks it; for delta lights the irradiance on a plane that faces the
  // light.
  C3 radiance;
  // The density of `direction` per steradian, including the probability of choosing the light. For delta
  // lights it is the probability of choosing the light alone.
  float pdf = 0;
  bool delta = false;
};

// The point on a light about which segments are sampled equi-angularly, and the cone into which it emits.
struct Pivot {
  V3 p;
  // Light leaves p only in directions whose cosine to the axis, a unit vector, is at least cos_reach. -1: in
  // all directions.
  V3 axis{0, 0, 0};
  float cos_reach = -1;

  Pivot(const V3& point) : p(point) {}
  Pivot(const V3& point, const V3& towards, float cosine) : p(point), axis(towards), cos_reach(cosine) {}
};

// Random words for choosing a light and a point on it. All 32 bits of each word are used, because with many
// lights or triangles even the last bits decide which of them is chosen.
struct LightNumbers {
  std::uint32_t light = 0, x = 0, y = 0;
  V2 unit() const { return {unit_float(x), unit_float(y)}; }
};

// Data that lights refer to, and conversions to the units of the world, where all lengths of the scene are
// multiplied by geometry.scale. Radiance and irradiance stay the same. So intensities (power per solid angle,
// that is, irradiance times squared distance) are multiplied by the square of the scale.
struct LightWorld {
  const Geometry& geometry;
  const TextureTable& textures;

  V3 place(const V3d& p) const { return V3((p - geometry.center) * geometry.scale); }
  double scale2() const { return geometry.scale * geometry.scale; }
};

struct LightKind {
  static constexpr bool kHasPlace = false;  // true if it has a position, that is, is not at infinite distance
  static constexpr bool kIsPoint = false;   // true if it has a position but no extent
  static constexpr bool kIsArea = false;    // true if it is an emitting surface

  static std::uint64_t extra_bytes() { return 0; }  // bytes of memory besides the struct itself
};

}  // namespace ls::render
