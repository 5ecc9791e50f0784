// Nori's `whitted` and `direct` against closed forms. In a closed room that shines 1 and reflects all alike a
// surface is as bright everywhere, so that each bounce is a factor.
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
  // 1e-5: sums of some hundred terms in single precision.
  EXPECT_NEAR(e.mean[1], expected, test::kStandardErrors * e.standard_error[1] + 1e-5 * expected);
}

// A ball seen from within.
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

// Emission, and half of it reflected once: 1.5 where all light is 1 / (1 - .5).
TEST(Whitted, EndsWithTheDirectLightOfADiffuseSurface) {
  expect_brightness(diffuse_room(), "whitted", -1, 1.5);
  expect_brightness(diffuse_room(), "path", 2, 1.5);
  expect_brightness(diffuse_room(), "path", -1, 2);
}

// A mirror shows itself: 1 + .8 (1 + .8 (...)) = 1 / (1 - .8); with one bounce 1.8.
TEST(Whitted, FollowsMirrorsToTheEnd) {
  const auto mirrors = [] { return room([](SceneBuilder& b) { return tinted_mirror(b, .8); }); };
  expect_brightness(mirrors(), "whitted", -1, 5);
  expect_brightness(mirrors(), "whitted", 3, 1 + .8 + .64);
  expect_brightness(mirrors(), "path", 2, 1.8);
}

// Of a blend, half of a mirror and half diffuse, L = 1 + .5 * .8 L + .5 * .5: the diffuse half has direct
// light alone.
TEST(Whitted, TellsThePartsOfAMaterialApart) {
  expect_brightness(room([](SceneBuilder& b) {
                      const BsdfIndex first = tinted_mirror(b, .8), second = b.diffuse(.5);
                      return b.bsdf(BlendBsdf{b.texture({.5, .5, .5}), first, second});
                    }),
                    "whitted", -1, 1.25 / .6);
}

// A floor below a ball of radius r = .5 that shines 1 at height 2, and a mirror in the plane x = 1, of which
// the ball's image is at (2, 0, 2). A ball at distance d, whole above the horizon, gives the irradiance pi
// r^2 / d^2 cos: pi / 16 by itself, and pi .25 / 8 * sqrt(.5) by way of the mirror, which `whitted` leaves
// out. The mirror shows the floor at (2, 0, 0), as bright as it is.
TEST(Whitted, LeavesOutWhatMirrorsThrowOnASurface) {
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

// All variants that cover a scene give the same bits.
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
