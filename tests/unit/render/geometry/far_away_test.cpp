// Rays that begin far outside of the scene, and cameras whose rays are not finite.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/render_check.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

constexpr float kInf = std::numeric_limits<float>::infinity();

// Debian's build of Embree aborts for rays whose origin is farther than 1.8e18. A flight through an extremely
// thin medium can get there.
TEST(FarAway, RaysMeetNothingAndNothingHidesLight) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  const auto w = test::world_of(builder);
  for (const float far : {1e10f, 1e18f, 1e20f, 3e38f}) {
    EXPECT_FALSE(w->accel.nearest({0, 0, far}, {0, 0, -1}, kInf)) << far;
    EXPECT_FALSE(w->accel.nearest({-far, 0, 0}, {0, 1, 0}, kInf)) << far;
    EXPECT_FALSE(w->accel.occluded({0, far, 0}, {0, -1, 0}, kInf)) << far;
  }
  EXPECT_TRUE(w->accel.nearest({0, 0, 1e3f}, {0, 0, -1}, kInf));
  EXPECT_TRUE(w->accel.occluded({0, 0, 1e3f}, {0, 0, -1}, kInf));
  EXPECT_TRUE(w->accel.occluded({0, 0, std::nanf("")}, {0, 0, -1}, kInf));
}

TEST(FarAway, AMediumThatIsAllButNothingRendersClean) {
  SceneBuilder builder({8, 8});
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 3}, {1, 1, 1}});
  builder.scene.sensor.medium = builder.homogeneous({1e-20, .3, 1.7}, {.9, .9, .9});
  builder.look({0, -5, 0}, {0, 0, 0}, 60);
  const auto e = test::estimate(builder, 64);
  EXPECT_EQ(e.health.nonfinite, 0u);
  EXPECT_GT(e.mean[0], 0);
}

std::string refusal(const Sensor& sensor) {
  SceneBuilder builder;
  builder.shape(SphereShape{}, {}, builder.diffuse(.5));
  builder.scene.sensor = sensor;
  const auto w = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  return w ? "" : w.error().message;
}

TEST(FarAway, CamerasWhoseRaysAreNoNumbersAreRefused) {
  constexpr double kHuge = 1.7e308;
  const auto refused = testing::HasSubstr("the rays of the sensor leave the range of single precision");
  EXPECT_THAT(refusal({.principal_point_offset = {-kHuge, 0}}), refused);
  EXPECT_THAT(refusal({.principal_point_offset = {0, kHuge}}), refused);
  EXPECT_THAT(refusal({.near_clip = 1e300, .far_clip = kHuge}), refused);
  EXPECT_THAT(refusal({.aperture_radius = kHuge}), refused);
  EXPECT_THAT(refusal({.aperture_radius = 1e-30, .focus_distance = 1e-300}), refused);
  EXPECT_EQ(refusal({.fov = 179.9, .far_clip = kHuge, .aperture_radius = 3, .focus_distance = 1e-3}), "");
}

}  // namespace
}  // namespace ls::render
