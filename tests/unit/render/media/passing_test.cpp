// Tests how passed surfaces count towards max_depth: one segment each in `path`, nothing in `volpath`, as in
// Mitsuba 3.
#include <gtest/gtest.h>

#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;

BsdfIndex pane(SceneBuilder& builder, bool null) {
  return null ? builder.null() : builder.bsdf(MaskBsdf{builder.texture({.5, .5, .5}), builder.diffuse(0)});
}

double brightness(SceneBuilder builder, const char* integrator, int max_depth) {
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = max_depth;
  const test::Estimate e = test::estimate(builder, 256, 0, 1);
  EXPECT_EQ(e.health.nonfinite, 0u);
  return e.mean[1];
}

// The camera sees a wall of radiance 1 through two null panes, or a quarter of its radiance through two
// half-transparent masks. The noise of 65,536 samples that see all or nothing is at most .0017.
TEST(PassedSurfaces, EndSegmentsOfPathButNotOfVolpath) {
  for (const bool null : {true, false}) {
    SceneBuilder builder;
    for (const double z : {1., 2.})
      builder.shape(RectangleShape{}, test::translate({0, 0, z}), pane(builder, null));
    builder.lamp(RectangleShape{}, test::translate({0, 0, 3}) * test::rotate_x(180));
    builder.look({0, 0, 0}, {0, 0, 3}, 1e-3, {0, 1, 0});
    const double seen = null ? 1 : .25;

    EXPECT_EQ(brightness(builder, "path", 1), 0);
    EXPECT_EQ(brightness(builder, "path", 2), 0);
    EXPECT_NEAR(brightness(builder, "path", 3), seen, .01);
    EXPECT_NEAR(brightness(builder, "path", -1), seen, .01);
    EXPECT_NEAR(brightness(builder, "volpath", 1), seen, .01);
  }
}

// A floor lies below a pane, which lies below a point light of intensity 4 pi at height 2. The floor's
// radiance is .5 / pi * 4 pi / 4 = .5 with a null pane, and half of that with a mask. The path has three
// segments, two of which belong to the shadow ray.
TEST(PassedSurfaces, EndSegmentsOfShadowRaysOfPathToo) {
  for (const bool null : {true, false}) {
    SceneBuilder builder;
    builder.shape(RectangleShape{}, {}, builder.diffuse(.5));
    builder.shape(RectangleShape{}, test::translate({0, 0, 1}) * test::scale(.1), pane(builder, null));
    const double i = 4 * test::kPi;
    builder.scene.emitters.push_back(PointEmitter{{0, 0, 2}, {i, i, i}});
    builder.look({.8, 0, .8}, {0, 0, 0});
    const double lit = null ? .5 : .25;

    EXPECT_EQ(brightness(builder, "path", 2), 0);
    EXPECT_NEAR(brightness(builder, "path", 3), lit, 1e-3 * lit);
    EXPECT_NEAR(brightness(builder, "volpath", 2), lit, 1e-3 * lit);
  }
}

}  // namespace
}  // namespace ls::render
