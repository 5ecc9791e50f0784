// Scenes of lights, and the irradiance that sampling these lights gives.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/render_check.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The words of numbers in [0, 1).
inline LightNumbers numbers(float light, float x, float y) {
  const auto bits = [](float f) { return static_cast<std::uint32_t>(f * 0x1p32f); };
  return {bits(light), bits(x), bits(y)};
}

// The world of a scene of one light, in which points are given in scene coordinates.
struct LightBench {
  std::shared_ptr<const World> world;
  explicit LightBench(const test::SceneBuilder& builder) : world(test::world_of(builder)) {}
  V3 at(const V3d& p) const { return V3((p - world->geometry.center) * world->geometry.scale); }

  struct Irradiance {
    double mean, se;
  };
  // Estimates the irradiance on a plane through x with the normal n, with a stratified square of light
  // samples.
  Irradiance irradiance(const V3d& x, const V3& n, int side = 128) const {
    RandomStream r(11);
    double sum = 0, square = 0;
    for (int i = 0; i < side * side; ++i) {
      const float u = (static_cast<float>(i % side) + r.uniform()) / static_cast<float>(side);
      const float v = (static_cast<float>(i / side) + r.uniform()) / static_cast<float>(side);
      const auto s = world->lights.sample(world->lights.choose(numbers(r.uniform(), u, v)), at(x));
      const double e = s ? s->radiance.x * std::max(0.f, dot(n, s->direction)) / s->pdf : 0;
      sum += e;
      square += e * e;
    }
    const double count = double{1} * side * side, mean = sum / count;
    // The error is that of unstratified samples, an upper bound.
    return {mean, std::sqrt(std::max(0., square / count - mean * mean) / count)};
  }
};
inline test::SceneBuilder area(const ls::Geometry& g, const Transform& t, bool flip = false) {
  test::SceneBuilder builder;
  builder.lamp(g, t).flip_normals = flip;
  return builder;
}
// Allows 5 standard errors of independent samples, and float32 rounding (the light's offset from its own
// surface is 2^-20 of the world's size).
inline void expect_close(const LightBench::Irradiance& e, double expected) {
  EXPECT_NEAR(e.mean, expected, 5 * e.se + expected * 1e-5);
  EXPECT_LT(e.se, .02 * expected);
}

// Samples the light of `b` at x, and calls f(sample, hit, cosine) for each sample that a ray from x hits.
// Leaves out samples behind another surface, whose hit is not at the sample's distance, and hits at grazing
// angles, where the light's offset moves the point along the light. Returns the number of calls.
template <class F>
int for_hits_of_samples(const LightBench& b, const V3& x, int samples, F f) {
  RandomStream r(5);
  int hits = 0;
  for (int i = 0; i < samples; ++i) {
    const auto s = b.world->lights.sample(b.world->lights.choose(numbers(0, r.uniform(), r.uniform())), x);
    if (!s) continue;
    const auto primitive = b.world->accel.nearest(x, s->direction, kInfinity);
    SurfaceHit hit;
    if (!primitive || !b.world->geometry.complete(*primitive, x, s->direction, hit)) continue;  // the rim
    if (std::abs(hit.t - s->distance) > 1e-5f * s->distance + 4e-6f) continue;
    const float cosine = std::abs(dot(hit.ng, s->direction));
    if (cosine < .05f) continue;
    ++hits;
    f(*s, hit, cosine);
  }
  return hits;
}

}  // namespace ls::render
