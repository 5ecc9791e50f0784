// Tests paths at the boundaries of media: the whole length inside a medium counts, and samples that were cut
// off do not.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/digest.h"
#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

// Returns the radiance of a floor under the sun, attenuated by a slab of the medium between them. The camera
// sees the floor from below the slab.
double lit_through(double half_thickness, double sigma_t) {
  SceneBuilder builder({1, 1});
  builder.scene.integrator.max_depth = 2;
  builder.shape(RectangleShape{}, test::scale(1), builder.diffuse(1));
  const MediumIndex black = builder.homogeneous({sigma_t, sigma_t, sigma_t}, {0, 0, 0});
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, translate({0, 0, .5}) * test::scale(.4, .4, half_thickness), null, black);
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {M_PI, M_PI, M_PI}});
  builder.look({0, -.9, .2}, {0, 0, 0});
  return render_sample(*test::world_of(builder), 0, 0, 0).rgb[0];
}

// The ray that continues behind a boundary starts 2^-20 of the world inside the medium. Positions are rounded
// to 2^-24 at both faces, so the length through a slab of 8 * 2^-20 has the error 2 * 2^-24 / (8 * 2^-20) =
// 1/64. If the part before the ray's start did not count, the length would be too short by 1/8.
TEST(Boundaries, KeepTheFullLengthThroughAMedium) {
  EXPECT_NEAR(lit_through(.1, 0), 1, 1e-5);
  EXPECT_NEAR(lit_through(.1, 5), std::exp(-1), 1e-5);
  // The world's scale is a power of two that brings its radius, here about 1.5, to at most 1. So it is one
  // half.
  const double thickness = 2 * 8 * 0x1p-20;
  const double depth = -std::log(lit_through(thickness / 2, 1 / thickness));
  EXPECT_NEAR(depth, 1, 1. / 32);
}

// A ray outside of any medium hits a mirror whose front side declares fog. The reflected light has passed the
// fog, whichever strategy finds it.
TEST(Boundaries, GiveReflectedRaysTheMediumOfTheirSide) {
  SceneBuilder builder({8, 8});
  const MediumIndex fog = builder.homogeneous({.7, .7, .7}, {0, 0, 0});
  Shape& mirror = builder.shape(RectangleShape{}, {}, builder.mirror());
  mirror.exterior = fog;
  mirror.is_medium_transition = true;
  builder.lamp(RectangleShape{}, translate({0, 2, 1}) * test::rotate_x(180));
  builder.look({0, -1, .5}, {0, 0, 0});
  // The ray reflected at the origin hits the light's plane z = 1 at (0, 2, 1).
  const auto e = test::estimate(builder, 256);
  EXPECT_NEAR(e.mean[0], std::exp(-.7 * std::sqrt(5.)), 5 * e.standard_error[0] + 1e-5);
  EXPECT_LT(e.standard_error[0], .02);
}

// A ray enters a ball at a very flat angle. The line from its offset origin leaves the ball later than the
// true line does, so a vertex near the end of the segment may lie outside of the ball. Rays that continue
// from there must hit the ball. A ray that misses it would have an infinite, emitting medium ahead of it, and
// thus infinite radiance.
TEST(Boundaries, KeepPathsInsideOfABallThatTheyGraze) {
  SceneBuilder builder({32, 32});
  const MediumIndex m = builder.heterogeneous(
      builder.grid({7, 7, 7}, std::vector<float>(7 * 7 * 7, .5f), translate({-1, -1, -1}) * test::scale(2)),
      Rgb{.5, .5, .5}, 100);
  builder.set_emission(m, {1, 1, 1});
  builder.container(SphereShape{}, {}, builder.null(), m);
  constexpr double kFromEdge = 1e-3;
  builder.look({kFromEdge - 1, -5, 0}, {kFromEdge - 1, 0, 0}, 2 * kFromEdge);
  const auto e = test::estimate(builder, 2048);
  EXPECT_EQ(e.health.nonfinite, 0u);
}

// Between a floor and the sun stand more null sheets than a shadow ray may cross. They form a column over the
// small part of the floor that the camera sees. So most paths leave the scene beside the column after their
// shadow ray was cut off.
TEST(Boundaries, RejectSamplesWhoseShadowRaysWereTruncated) {
  std::string text;
  constexpr int kSheets = (1 << 16) + 1;
  for (int i = 0; i < kSheets; ++i) {
    const double z = .2 + i * .7 / kSheets;
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      text += "v " + std::to_string(.1 * x) + ' ' + std::to_string(.1 * y) + ' ' + std::to_string(z) + '\n';
    text += "f -4 -3 -2 -1\n";
  }
  SceneBuilder builder({1, 1});
  MeshShape mesh;
  mesh.file = builder.asset("sheets.obj", text);
  // Without a medium, shadow rays would not cross the sheets one by one.
  const MediumIndex thin = builder.homogeneous({.01, .01, .01}, {0, 0, 0});
  const BsdfIndex null = builder.null();
  builder.container(mesh, {}, null, thin);
  builder.shape(RectangleShape{}, {}, builder.diffuse(1));
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
  builder.look({0, -.1, .15}, {0, 0, 0});
  builder.scene.sensor.fov = 10;
  const auto world = test::world_of(builder);
  for (std::uint64_t s = 0; s < 16; ++s) {
    const SampleValue value = render_sample(*world, 0, 0, s);
    EXPECT_FALSE(value.finite) << s;
    EXPECT_EQ(value.health.causes.count(HealthCause::too_many_surfaces), 1u) << s;
  }
}

}  // namespace
}  // namespace ls::render
