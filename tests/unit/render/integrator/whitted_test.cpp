// Tests Nori's `whitted` and `direct` against closed forms. In a closed room of one material, whose walls
// emit radiance 1, the radiance is the same everywhere, so each bounce is a factor.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "tests/support/significance.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;

void expect_brightness(SceneBuilder builder, const char* integrator, int max_depth, double expected) {
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = max_depth;

  const test::Estimate e = test::estimate(builder, 256, 0, 1);

  EXPECT_EQ(e.health.nonfinite, 0u);
  // The term 1e-5 accounts for sums of some hundred terms in float32.
  EXPECT_NEAR(e.mean[1], expected, test::kStandardErrors * e.standard_error[1] + 1e-5 * expected);
}

// A ball that emits light, seen from inside.
SceneBuilder room(const auto& material) {
  SceneBuilder builder;
  const BsdfIndex bsdf = material(builder);
  Shape& ball = builder.shape(SphereShape{}, {}, bsdf);
  ball.flip_normals = true;
  ball.emitter = AreaEmitter{builder.texture({1, 1, 1})};
  builder.look({.1, .2, .3}, {1, 0, 0}, 60);
  return builder;
}
SceneBuilder diffuse_room() {
  return room([](SceneBuilder& b) { return b.diffuse(.5); });
}
BsdfIndex tinted_mirror(SceneBuilder& b, double r) {
  return b.bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, b.texture({r, r, r})});
}

// The emission, plus half of it reflected once, is 1.5. With all reflections it is 1 / (1 - .5) = 2.
TEST(Whitted, EndsAtTheDirectLightOfADiffuseSurface) {
  expect_brightness(diffuse_room(), "whitted", -1, 1.5);
  expect_brightness(diffuse_room(), "path", 2, 1.5);
  expect_brightness(diffuse_room(), "path", -1, 2);
}

// The mirror reflects itself: the radiance is 1 + .8 (1 + .8 (...)) = 1 / (1 - .8), and 1.8 with one bounce.
TEST(Whitted, FollowsMirrorsToTheEnd) {
  const auto mirrors = [] { return room([](SceneBuilder& b) { return tinted_mirror(b, .8); }); };
  expect_brightness(mirrors(), "whitted", -1, 5);
  expect_brightness(mirrors(), "whitted", 3, 1 + .8 + .64);
  expect_brightness(mirrors(), "path", 2, 1.8);
}

// Half of the material is a mirror and half is diffuse: L = 1 + .5 * .8 L + .5 * .5, since the diffuse half
// reflects direct light only.
TEST(Whitted, DistinguishesThePartsOfAMaterial) {
  expect_brightness(room([](SceneBuilder& b) {
                      const BsdfIndex first = tinted_mirror(b, .8), second = b.diffuse(.5);
                      return b.bsdf(BlendBsdf{b.texture({.5, .5, .5}), first, second});
                    }),
                    "whitted", -1, 1.25 / .6);
}

// A floor below a ball of radius r = .5 that emits radiance 1 at height 2. A mirror in the plane x = 1 has
// the ball's image at (2, 0, 2). A ball at distance d, all of it above the horizon, gives the irradiance pi
// r^2 / d^2 cos: pi / 16 directly, and pi .25 / 8 * sqrt(.5) through the mirror, which `whitted` leaves out.
// The mirror shows the floor at (2, 0, 0) with the same radiance.
TEST(Whitted, LeavesOutCausticsOfMirrors) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, test::scale(.2), builder.diffuse(.5));
  builder.shape(SphereShape{{0, 0, 2}, .5}, {}, builder.diffuse(0)).emitter =
      AreaEmitter{builder.texture({1, 1, 1})};
  builder.shape(RectangleShape{}, test::translate({1, 0, 0}) * test::rotate_y(-90) * test::scale(3),
                builder.mirror());
  const double straight = .5 / 16, mirrored = .5 * .25 / 8 * std::sqrt(.5);

  for (const double x : {0., 2.}) {
    builder.look({-.8, 0, .8}, {x, 0, 0}, 1e-3);
    expect_brightness(builder, "whitted", -1, straight);
    expect_brightness(builder, "path", -1, straight + mirrored);
  }
}

// All variants that have the features of a scene give the same bits.
TEST(Whitted, HasTheSameBitsInAllItsVariants) {
  SceneBuilder builder = diffuse_room();
  builder.shape(SphereShape{{.5, 0, 0}, .2}, {}, builder.glass(1.5));
  builder.scene.integrator.name = "whitted";
  const auto world = test::world_of(builder);
  const auto names = covering_variants(*world);
  ASSERT_EQ(names.size(), 3u);

  const PixelRect tile{0, 0, 8, 8};
  const auto first = render_tile_as(*world, names[0], tile, {0, 8}).sums;

  for (const std::string& name : names)
    EXPECT_EQ(render_tile_as(*world, name, tile, {0, 8}).sums, first) << name;
}

}  // namespace
}  // namespace ls::render
