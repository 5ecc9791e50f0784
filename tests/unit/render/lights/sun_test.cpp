// Directional lights with an angular radius: suns of finite size.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

constexpr double kRadii[] = {1e-3, .267, 5, 45, 90};

// A sun that shines from +z, with the irradiance 2, on a small floor.
SceneBuilder sunny(double radius, const Vec3& direction = {0, 0, -1}) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, test::scale(.1), builder.diffuse(.5));
  builder.scene.emitters.push_back(DirectionalEmitter{direction, {2, 2, 2}, radius});
  return builder;
}
double radiance(double degrees) { return 2 / (M_PI * std::pow(std::sin(degrees * M_PI / 180), 2)); }

TEST(Sun, LightsAFacingPlaneWithItsIrradiance) {
  for (const double radius : kRadii) {
    const LightBench b(sunny(radius));
    const auto e = b.irradiance({0, 0, 0}, {0, 0, 1}, 256);
    EXPECT_NEAR(e.mean, 2, 5 * e.se + 2e-5) << radius;
  }
}

// While the whole disk is above the plane, its mean direction is its centre.
TEST(Sun, FollowsTheCosineWhileItIsUp) {
  for (const double radius : {.267, 5., 40.})
    for (const double angle : {10., 49.}) {
      const double a = angle * M_PI / 180;
      const LightBench b(sunny(radius));
      const auto e = b.irradiance({0, 0, 0}, V3(std::sin(a), 0, std::cos(a)), 256);
      EXPECT_NEAR(e.mean, 2 * std::cos(a), 5 * e.se + 2e-5) << radius << " " << angle;
    }
}

TEST(Sun, SamplesAndVisibleDiskAgree) {
  for (const double radius : kRadii) {
    const LightBench b(sunny(radius, {.3, -.5, -.7}));
    const double a = radius * M_PI / 180, solid_angle = 4 * M_PI * std::pow(std::sin(a / 2), 2);
    RandomStream r(3);
    int seen = 0;
    for (int i = 0; i < 10000; ++i) {
      const auto s = b.world->lights.sample(b.world->lights.choose(numbers(0, r.uniform(), r.uniform())),
                                            b.at({0, 0, 0}));
      ASSERT_TRUE(s);
      EXPECT_FALSE(s->delta);
      ASSERT_FLOAT_EQ(s->radiance.x, static_cast<float>(radiance(radius)));
      ASSERT_FLOAT_EQ(s->pdf, static_cast<float>(1 / solid_angle));
      // A path that leaves in this direction, sampled with the density q, gets q / (q + p) of the light.
      const C3 full = b.world->lights.environment(V3(0), s->direction, kInfinity, {});
      if (is_black(full)) continue;
      ++seen;
      ASSERT_FLOAT_EQ(full.x, s->radiance.x);
      const float q = 3 * s->pdf;
      ASSERT_FLOAT_EQ(b.world->lights.environment(V3(0), s->direction, q, {}).x,
                      s->radiance.x * q / (q + s->pdf));
      const Lights::EnvironmentParts parts = b.world->lights.environment_parts(V3(0), s->direction, {});
      ASSERT_EQ(parts.unsampled, C3(0));
      ASSERT_EQ(parts.sampled, full);
      ASSERT_FLOAT_EQ(parts.pdf, s->pdf);
    }
    // Each component of a direction is accurate to 6e-8. This blurs the rim of the disk, whose radius is at
    // least 1.7e-5, so at most 2 sqrt(3) 6e-8 / 1.7e-5 = 1.2 % of its area.
    EXPECT_GE(seen, radius > .1 ? 9990 : 9850) << radius;
  }
}

TEST(Sun, EndsAtItsRim) {
  for (const double radius : {.267, 5., 45.}) {
    const LightBench b(sunny(radius));
    const auto at = [&](double degrees) {
      const double a = degrees * M_PI / 180;
      return b.world->lights.environment(V3(0), V3(std::sin(a), 0, std::cos(a)), kInfinity, {}).x;
    };
    EXPECT_FLOAT_EQ(at(.999 * radius), static_cast<float>(radiance(radius)));
    EXPECT_EQ(at(1.001 * radius), 0);
    EXPECT_EQ(at(180), 0);
  }
}

TEST(Sun, WithoutSizeItIsAParallelLight) {
  for (const double radius : {0., 9e-4}) {
    const LightBench b(sunny(radius));
    const auto s = b.world->lights.sample(b.world->lights.choose(numbers(.5f, .1f, .2f)), b.at({0, 0, 0}));
    ASSERT_TRUE(s && s->delta);
    EXPECT_EQ(s->radiance, C3(2));
    EXPECT_EQ(s->direction, V3(0, 0, 1));
    EXPECT_FALSE(b.world->lights.has_environment());
  }
}

// Next-event estimation and paths that leave the scene share the light by their densities. Together they must
// find all of it: on a floor (radiance .5 E / pi), in a mirror and for the camera.
TEST(Sun, AllTechniquesTogetherCountItOnce) {
  for (const double radius : {2., 30., 80.}) {
    SceneBuilder builder = sunny(radius);
    builder.look({.5, 0, 1}, {0, 0, 0});
    const auto e = test::estimate(builder, 512);
    EXPECT_NEAR(e.mean[0], 1 / M_PI, 5 * e.standard_error[0] + 1e-5) << radius;
    EXPECT_LT(e.standard_error[0], .02);
  }
  SceneBuilder builder = sunny(5);
  builder.scene.shapes[0].bsdf = builder.mirror();
  builder.look({0, .02, 1}, {0, 0, 0}, 1e-3, {0, 1, 0});
  EXPECT_NEAR(test::estimate(builder, 16).mean[0], radiance(5), 1e-5 * radiance(5));
  builder.look({0, 0, 1}, {0, .02, 2}, 1e-3, {0, 1, 0});
  EXPECT_NEAR(test::estimate(builder, 16).mean[0], radiance(5), 1e-5 * radiance(5));
  builder.scene.integrator.hide_emitters = true;
  EXPECT_EQ(test::estimate(builder, 16).mean[0], 0);
}

}  // namespace
}  // namespace ls::render
