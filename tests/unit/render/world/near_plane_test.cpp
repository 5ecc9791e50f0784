// Boundaries of media that lie before the camera's near plane, so that no ray meets them.
#include "worker/render/world/near_plane.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/scene/motion.h"
#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::scale;
using test::SceneBuilder;
using test::translate;
using test::operator*;

// A scene of a camera at y = `eye` that looks along +y, before a white sky, with near plane `near`.
SceneBuilder before_sky(double eye, double near, double x = 0) {
  SceneBuilder builder({16, 16});
  builder.environment();
  builder.look({x, eye, 0}, {x, eye + 1, 0});
  builder.scene.sensor.near_clip = near;
  return builder;
}
// Expects that the camera sees this share of the sky, within five standard errors: each sample is absorbed or
// not.
void expect_transmitted(const SceneBuilder& builder, double share, const std::string& what = "") {
  const auto e = test::estimate(builder, 32);
  EXPECT_NEAR(e.mean[0], share, 5 * e.standard_error[0] + 1e-6) << what;
  EXPECT_LT(e.standard_error[0], .01) << what;
}

// Through a body of 2 with the extinction 1, behind its face at -1: from outside with the face before the
// near plane, from the face itself, and from a little inside without a `medium` of the sensor. The near plane
// is up to 0.1 from the lens, and what lies before it is not seen, so that as much of the way may be missing.
TEST(NearPlane, HidesNoMediumBehindIt) {
  for (const ls::Geometry& body : {ls::Geometry(SphereShape{}), ls::Geometry(CubeShape{})})
    for (const auto& [eye, near] :
         {std::pair{-1.05, .1}, {-1., .1}, {-1., 1e-4}, {-1.001, .01}, {-5., 4.05}}) {
      SceneBuilder builder = before_sky(eye, near);
      builder.container(body, {}, builder.null(), builder.homogeneous({1, 1, 1}, {0, 0, 0}));

      const double hidden = std::max(0., eye + near + 1);

      expect_transmitted(builder, std::exp(-(2 - hidden)), fmt::format("{} {}", eye, near));
    }
}

TEST(NearPlane, IgnoresAMediumThatEndsBeforeIt) {
  SceneBuilder builder = before_sky(-.05, .1);
  const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
  builder.container(CubeShape{}, translate({0, -1, 0}), builder.null(), fog);
  builder.scene.sensor.medium = fog;

  expect_transmitted(builder, 1);
}

// The camera stands on the face of the fog that it names, or just before it. Another body in this medium
// makes the media overlap.
TEST(NearPlane, UsesTheSensorsMediumOnce) {
  for (const bool overlaps : {false, true})
    for (const auto& [eye, near] : {std::pair{-1., 1e-4}, {-1.05, .1}}) {
      SceneBuilder builder = before_sky(eye, near);
      const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
      builder.container(CubeShape{}, {}, builder.null(), fog);
      builder.scene.sensor.medium = fog;
      if (overlaps)
        builder.container(CubeShape{}, translate({0, -9, 0}), builder.null(),
                          builder.homogeneous({2, 2, 2}, {0, 0, 0}));

      const double hidden = eye + near + 1;

      EXPECT_EQ(test::world_of(builder)->overlaps, overlaps);
      expect_transmitted(builder, std::exp(-(2 - hidden)), fmt::format("{} {} {}", overlaps, eye, near));
    }
}

// Both faces of a thin slab of fog, and the face of a ball in it, lie before the near plane.
TEST(NearPlane, IsInTheInnermostOfSeveralBodies) {
  SceneBuilder builder = before_sky(-1.15, .3);
  const MediumIndex thin = builder.homogeneous({9, 9, 9}, {0, 0, 0}),
                    ball = builder.homogeneous({1, 1, 1}, {0, 0, 0});
  builder.container(CubeShape{}, translate({0, -1.08, 0}) * scale(1, .02, 1), builder.null(), thin);
  builder.container(SphereShape{}, {}, builder.null(), ball);

  expect_transmitted(builder, std::exp(-1.85));
}

// Where nothing lies before the near plane, rays start as ever, and cost nothing.
TEST(NearPlane, IsCheckedOnlyIfABoundaryMayLieBeforeIt) {
  const auto asked = [](double eye, double x) {
    SceneBuilder builder = before_sky(eye, .1, x);
    builder.container(CubeShape{}, {}, builder.null(), builder.homogeneous({1, 1, 1}, {0, 0, 0}));
    return test::world_of(builder)->hidden_boundaries;
  };

  EXPECT_TRUE(asked(-1.05, 0));
  EXPECT_FALSE(asked(-1.2, 0));
  EXPECT_FALSE(asked(-1.05, 3));
  EXPECT_FALSE(asked(0, 0)) << "inside, away from the faces";
}

// A camera that moves along x by `way` before a body whose face is at `face`.
SceneBuilder passing_by(double face, double way, bool named) {
  SceneBuilder builder({16, 16});
  builder.environment();
  builder.look({0, 0, 0}, {0, 1, 0});
  const MediumIndex fog = builder.homogeneous({1, 1, 1}, {0, 0, 0});
  builder.container(CubeShape{}, translate({face + 5, 0, 0}) * scale(5), builder.null(), fog);
  if (named) builder.scene.sensor.medium = fog;
  Sensor& s = builder.scene.sensor;
  const Transform begin = s.to_world, end = translate({way, 0, 0}) * begin;
  s.motion = {{0, begin}, {1, end}};
  s.to_world = translate({way / 2, 0, 0}) * begin;
  s.shutter_close = 1;
  return builder;
}

TEST(NearPlane, ACameraThatMovesStaysInItsMedium) {
  const auto built = [](const SceneBuilder& b) {
    return build_world(b.scene, test::settings_of(b.scene), b.files, 1);
  };
  for (const double way : {1., -1., 1e-3})
    EXPECT_TRUE(built(passing_by(way > 0 ? 2 * way : 1, way, false))) << way;
  EXPECT_TRUE(built(passing_by(-5, 1, true)));
  for (const double face : {.5, .01, .99}) {
    const auto refused = built(passing_by(face, 1, false));
    ASSERT_FALSE(refused) << face;
    EXPECT_EQ(refused.error().code, Errc::invalid_argument);
    EXPECT_NE(refused.error().message.find("the camera moves through the boundary of a medium"),
              std::string::npos);
  }
}

TEST(NearPlane, HidesBoundariesFromACameraThatMoves) {
  // The face is between the lens and the near plane at all times.
  SceneBuilder builder = before_sky(-1.05, .1);
  builder.container(CubeShape{}, scale(1, 1, 100), builder.null(), builder.homogeneous({1, 1, 1}, {0, 0, 0}));
  Sensor& s = builder.scene.sensor;
  const Transform begin = s.to_world;
  s.motion = {{0, begin}, {1, translate({0, 0, 3}) * begin}};
  s.to_world = begin;
  s.shutter_close = 1;
  expect_transmitted(builder, std::exp(-1.95), "moving");
}

}  // namespace
}  // namespace ls::render
