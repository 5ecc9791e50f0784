// Hits of rays that are given in scene coordinates, and a material that needs all data of a hit.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/scene_builder.h"
#include "worker/render/world/world.h"

namespace ls::render {

// A material that needs uv and tangents of hits.
inline BsdfIndex brushed(test::SceneBuilder& builder) {
  const TextureIndex grey = builder.texture({.5, .5, .5}), white = builder.texture({1, 1, 1});
  RoughConductorBsdf b;
  b.alpha_u = builder.texture({.1, .1, .1});
  b.alpha_v = builder.texture({.3, .3, .3});
  b.specular_reflectance = test::SceneBuilder::push<TextureTag>(
      builder.scene.textures, Texture(CheckerboardTexture{grey, white, {}}));
  return builder.bsdf(b);
}

// Returns the first hit of the ray from `from` towards `to`.
inline SurfaceHit hit_towards(const World& w, const V3d& from, const V3d& to) {
  const auto at = [&](const V3d& p) { return (p - w.geometry.center) * w.geometry.scale; };
  const V3 o(at(from)), d((at(to) - at(from)).normalized());
  const auto primitive = w.accel.nearest(o, d, kInfinity);
  SurfaceHit hit;
  EXPECT_TRUE(primitive && w.geometry.complete(*primitive, o, d, hit));
  return hit;
}

}  // namespace ls::render
