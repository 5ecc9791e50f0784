// Where media begin and end: no way through them is left out, and no sample that was cut off is counted.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/digest.h"
#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

// A floor in the light of a sun overhead, seen from below a slab of the medium that hangs over it.
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

// The ray that goes on behind a boundary starts 2^-20 of the world farther in. Places are rounded to 2^-24 at
// both faces, so a slab of 8 * 2^-20 is thick to 2 * 2^-24 / (8 * 2^-20) = 1/64; without the way that the
// ray starts in it would be thinner by 1/8.
TEST(Boundaries, LoseNoneOfTheWayThroughAMedium) {
  EXPECT_NEAR(lit_through(.1, 0), 1, 1e-5);
  EXPECT_NEAR(lit_through(.1, 5), std::exp(-1), 1e-5);
  // The world's scale is a power of two that brings its radius, here about 1.5, to at most 1: half the unit.
  const double thickness = 2 * 8 * 0x1p-20;
  const double depth = -std::log(lit_through(thickness / 2, 1 / thickness));
  EXPECT_NEAR(depth, 1, 1. / 32);
}

// A mirror that looks into fog, met by a ray that was in none: what it reflects has come through the fog, by
// whichever strategy it is found.
TEST(Boundaries, GiveReflectedRaysTheMediumOfTheirSide) {
  SceneBuilder builder({8, 8});
  const MediumIndex fog = builder.homogeneous({.7, .7, .7}, {0, 0, 0});
  Shape& mirror = builder.shape(RectangleShape{}, {}, builder.mirror());
  mirror.exterior = fog;
  mirror.is_medium_transition = true;
  builder.lamp(RectangleShape{}, translate({0, 2, 1}) * test::rotate_x(180));
  builder.look({0, -1, .5}, {0, 0, 0});
  // From the mirror at the origin the light's plane z = 1 is met at (0, 2, 1).
  const auto e = test::estimate(builder, 256);
  EXPECT_NEAR(e.mean[0], std::exp(-.7 * std::sqrt(5.)), 5 * e.standard_error[0] + 1e-5);
  EXPECT_LT(e.standard_error[0], .02);
}

// A ray that enters a ball at so flat an angle that the line from its moved start leaves it farther on than
// the true one does: a vertex between the two ends stands outside. Rays that are sent on from there must meet
// the ball; one that does not has a medium without end ahead of it, which here gives off light: infinitely
// much.
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

// More null sheets than a ray may cross between a floor and its sun: a column over the little that the camera
// sees of the floor, so that most paths leave the scene beside it after their shadow ray was cut off.
TEST(Boundaries, RejectSamplesWhoseShadowRaysAreCutOff) {
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
  const MediumIndex thin =
      builder.homogeneous({.01, .01, .01}, {0, 0, 0});  // of none, nothing would be walked
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
