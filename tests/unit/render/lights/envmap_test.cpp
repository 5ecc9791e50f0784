// Environment maps: the directions of texels, the interpolation between them, refused maps, and scenes under
// maps.
#include "worker/render/lights/envmap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/render_check.h"
#include "tests/unit/render/envmap_builder.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::SkyImage;
using ::testing::HasSubstr;
using test::operator*;

constexpr double kPiExact = 3.14159265358979323846;

std::string refusal(const SkyImage& s, const Transform& t = {}, double scale = 1) {
  const auto m = try_map(s, t, scale);
  return m ? "accepted" : m.error().message;
}
// Texel (x, y) has the value 10 y + x + 1; the rows at the poles have one value each.
SkyImage numbered() {
  SkyImage s(4, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) {
      const double v = 10. * y + (y == 1 ? x : 0) + 1;
      s.set(x, y, {v, v, v});
    }
  return s;
}
float value(const EnvironmentMap& m, const V3& d) { return m.at(normalize(d)).radiance.x; }
// Directions are float32 and texels of these maps are more than a radian wide, so values, which are below 32,
// are accurate to 2^-20 of 32.
constexpr float kEps = 32 * 0x1p-20f;

// In Mitsuba 3 (u, v) = (atan2(x, -z) / 2 pi, acos(y) / pi). The centres of the columns are at u = 1/8, 3/8,
// 5/8 and 7/8, halfway between the axes of the horizon: from -z over +x to +z and -x.
TEST(EnvironmentMap, TexelPositionsMatchMitsuba) {
  const EnvironmentMap m = map_of(numbered());
  EXPECT_NEAR(value(m, {1, 0, -1}), 11, kEps) << "u = 1/8: from -z towards +x";
  EXPECT_NEAR(value(m, {1, 0, 1}), 12, kEps) << "u = 3/8";
  EXPECT_NEAR(value(m, {-1, 0, 1}), 13, kEps) << "u = 5/8";
  EXPECT_NEAR(value(m, {-1, 0, -1}), 14, kEps) << "u = 7/8";
  EXPECT_NEAR(value(m, {0, 1, 0}), 1, kEps) << "the top row is the pole +y itself";
  EXPECT_NEAR(value(m, {0, -1, 0}), 21, kEps) << "the bottom row is -y";
}

TEST(EnvironmentMap, IsBilinearBetweenTexelsAndRepeatsAround) {
  const EnvironmentMap m = map_of(numbered());
  EXPECT_NEAR(value(m, {1, 0, 0}), 11.5, kEps) << "u = 1/4";
  EXPECT_NEAR(value(m, {0, 0, 1}), 12.5, kEps) << "the middle of the image";
  EXPECT_NEAR(value(m, {0, 0, -1}), 12.5, kEps) << "its left and right edge: of 14 and 11";
  // 22.5 degrees from the centre of the column with the value 14: a quarter of the way to the column with 11.
  const auto s = static_cast<float>(std::sin(kPiExact / 8)), c = static_cast<float>(std::cos(kPiExact / 8));
  EXPECT_NEAR(value(m, {-s, 0, -c}), 14 + (11 - 14) * .25, kEps);
  // 45 degrees above the horizon: the mean of the pole and the horizon.
  const auto r = static_cast<float>(std::sqrt(.5));
  EXPECT_NEAR(value(m, {r, 1, -r}), (11 + 1) / 2., kEps);
  EXPECT_NEAR(value(m, {r, -1, r}), (12 + 21) / 2., kEps);
}

TEST(EnvironmentMap, OnlyRotationAndMirroringOfToWorldMatter) {
  const SkyImage s = numbered();
  // Turns z to x, so the middle of the image is at +x.
  EXPECT_NEAR(value(map_of(s, test::rotate_y(90)), {1, 0, 0}), 12.5, kEps);
  // Turns y to z, so the pole is at +z.
  EXPECT_NEAR(value(map_of(s, test::rotate_x(90)), {0, 0, 1}), 1, kEps);
  // Turns first about x, then about y.
  EXPECT_NEAR(value(map_of(s, test::rotate_y(90) * test::rotate_x(90)), {1, 0, 0}), 1, kEps);
  EXPECT_NEAR(value(map_of(s, test::scale(-1, 1, 1)), {-1, 0, -1}), 11, kEps);
  EXPECT_NEAR(value(map_of(s, test::translate({5, 6, 7}) * test::scale(3)), {1, 0, -1}), 11, kEps);
  EXPECT_NEAR(value(map_of(s, {}, 2.5), {1, 0, -1}), 27.5, 3 * kEps);
}

TEST(EnvironmentMap, NegativeTexelsBecomeBlackAndAreCounted) {
  SkyImage s(4, 3, 1);
  s.set(0, 1, {-5, 1, -.5});
  const EnvironmentMap m = map_of(s);
  EXPECT_EQ(m.clamped(), 2u);
  EXPECT_NEAR(m.at(normalize(V3(1, 0, -1))).radiance.x, 0, kEps);
  EXPECT_NEAR(m.at(normalize(V3(1, 0, -1))).radiance.y, 1, kEps);
}

TEST(EnvironmentMap, InvalidMapIsRefusedByName) {
  SkyImage bad(4, 3, 1);
  bad.set(2, 1, {1, std::numeric_limits<double>::quiet_NaN(), 1});
  EXPECT_THAT(refusal(bad), HasSubstr("the texel at x 2, y 1"));
  bad.set(2, 1, {1, std::numeric_limits<double>::infinity(), 1});
  EXPECT_THAT(refusal(bad), HasSubstr("infinite"));
  bad.set(2, 1, {1, 1e30, 1});
  EXPECT_THAT(refusal(bad), HasSubstr("x 2, y 1"));
  bad.set(2, 1, {1, 1e20, 1});
  EXPECT_EQ(refusal(bad), "accepted");
  EXPECT_THAT(refusal(bad, {}, 1e10), HasSubstr("more than samples of light may be"));
  EXPECT_THAT(refusal(SkyImage(4, 3, 1), {}, -1), HasSubstr("scale"));
  EXPECT_THAT(refusal(SkyImage(4, 2, 1)), HasSubstr("at least 2 x 3"));
  EXPECT_THAT(refusal(SkyImage(1, 4, 1)), HasSubstr("at least 2 x 3"));
  EXPECT_THAT(refusal(SkyImage(4, 3, 1), test::scale(1, 2, 1)), HasSubstr("may turn and mirror"));
  EXPECT_THAT(refusal(SkyImage(4, 3, 1), test::scale(1, 0, 1)), HasSubstr("may turn and mirror"));
}

TEST(EnvironmentMap, MoreThan8192By4096PixelsAreRefused) {
  ImageData d;
  d.width = 16384;
  d.height = 8192;
  d.channels = 3;
  const auto m = EnvironmentMap::build("huge.exr", d, 1, {});
  ASSERT_FALSE(m);
  EXPECT_EQ(m.error().code, Errc::resource_exhausted);
  EXPECT_THAT(m.error().message,
              HasSubstr("'huge.exr' has 16384 x 8192 pixels; scale it down to 8192 x 4096"));
}

// Maps in a world

SceneBuilder under_sky(const SkyImage& s, const Transform& t = {}) {
  SceneBuilder builder({4, 4});
  const BsdfIndex white = builder.diffuse(.5);
  builder.shape(RectangleShape{}, test::scale(3), white);
  builder.look({0, -4, 2}, {0, 0, 0}, 1e-3);
  test::add_sky(builder, s, t);
  return builder;
}

TEST(EnvironmentMap, GivesTheIrradianceOfOneTexel) {
  const SkyImage black(32, 16);
  // The map's +y is +z here. The bright texel is 60 degrees above the horizon, at several azimuths.
  for (const int x : {0, 5, 17, 31}) {
    SkyImage s = black;
    s.set(x, 5, {34000, 34000, 34000});
    const auto world = test::world_of(under_sky(s, test::rotate_x(90)));
    const Vec3 e = test::one_texel_irradiance(32, 16, x, 5);
    // rotate_x(90) turns (x, y, z) to (x, -z, y).
    const V3 expected(V3d(e[0], -e[2], e[1]) * 34000.);
    RandomStream r(4);
    constexpr int kSide = 128;
    V3d sum(0, 0, 0);
    for (int i = 0; i < kSide * kSide; ++i) {
      const auto word = [&](int k) {
        return static_cast<std::uint32_t>((static_cast<float>(k) + r.uniform()) / kSide * 0x1p32f);
      };
      const std::uint32_t a = word(i % kSide), b = word(i / kSide);
      const auto l = world->lights.sample(world->lights.choose({0, a, b}), V3(0));
      ASSERT_TRUE(l);
      EXPECT_FALSE(l->delta);
      sum += V3d(l->direction) * double{l->radiance.x / l->pdf};
    }
    const V3 mean(sum / double{kSide * kSide});
    // With stratified samples the error of a smooth integrand is about 1 / side^2 of its variation, which is
    // .2.
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(mean[k], expected[k], 1e-4f * std::sqrt(dot(expected, expected))) << x;
  }
}

TEST(EnvironmentMap, IsSeenByTheCameraUnlessEmittersAreHidden) {
  SkyImage s(8, 5, .5f);
  SceneBuilder builder({2, 2});
  test::add_sky(builder, s, {}, 4);
  EXPECT_FLOAT_EQ(static_cast<float>(render_sample(*test::world_of(builder), 0, 0, 0).rgb[1]), 2);
  builder.scene.integrator.hide_emitters = true;
  EXPECT_EQ(render_sample(*test::world_of(builder), 0, 0, 0).rgb[1], 0);
  // The map still lights the scene: half of the radiance 0.5 that comes from above is reflected.
  SceneBuilder lit = under_sky(s);
  lit.scene.integrator.hide_emitters = true;
  const test::Estimate e = test::estimate(lit, 256);
  EXPECT_NEAR(e.mean[0], .25, 6 * e.standard_error[0] + 1e-5);
}

TEST(EnvironmentMap, IsSampledInProportionToItsPower) {
  // A light is chosen with the probability 1/2 in proportion to power, else uniformly. The power of the map
  // is the flux through the ball that bounds the world.
  SceneBuilder builder = under_sky(SkyImage(8, 5, 1));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, 1}, {1, 1, 1}});
  const auto world = test::world_of(builder);
  const LightChoice c = world->lights.choose({0, 0, 0});
  const auto l = world->lights.sample(c, V3(0));
  const double r = world->geometry.radius / world->geometry.scale, power = 4 * kPiExact * kPiExact * r * r;
  const double expected = .25 + .5 * power / (power + 4 * kPiExact);
  ASSERT_TRUE(l);
  EXPECT_NEAR(l->pdf * 4 * kPiExact, expected, 1e-4);
  // A path that leaves the scene in this direction, sampled with the same density, gets half of the light.
  EXPECT_FLOAT_EQ(world->lights.environment(V3(0), l->direction, l->pdf, {}).x, .5f);
  EXPECT_FLOAT_EQ(world->lights.environment(V3(0), l->direction, kInfinity, {}).x, 1);
}

TEST(EnvironmentMap, IsSampledSeparatelyFromAConstantSky) {
  SceneBuilder builder = under_sky(SkyImage(8, 5, 1));
  builder.scene.emitters.push_back(ConstantEmitter{{.25, .25, .25}});
  const auto world = test::world_of(builder);
  const V3 d = normalize(V3(.3f, .2f, .9f));
  const Lights::EnvironmentParts parts = world->lights.environment_parts(V3(0), d, {});
  EXPECT_EQ(parts.unsampled, C3(.25f));
  EXPECT_FLOAT_EQ(parts.sampled.x, 1);
  EXPECT_GT(parts.pdf, 0);
  for (const float pdf : {.01f, .3f, 20.f})
    EXPECT_FLOAT_EQ(world->lights.environment(V3(0), d, pdf, {}).x, .25f + 1 / (1 + parts.pdf / pdf)) << pdf;
}

TEST(EnvironmentMap, IsCountedInTheReport) {
  SkyImage s(8, 5, 1);
  s.set(3, 2, {-1, 0, 0});
  const WorldReport r = describe(*test::world_of(under_sky(s)));
  EXPECT_EQ(r.clamped_inputs, 1u);
  EXPECT_THAT(r.used, ::testing::Contains(HasSubstr("environment map")));
  EXPECT_THAT(r.used, ::testing::Contains("next-event estimation"));

  const WorldReport black = describe(*test::world_of(under_sky(SkyImage(8, 5))));
  EXPECT_THAT(black.left_out, ::testing::Contains("1 lights without power or area"));
  EXPECT_THAT(black.left_out, ::testing::Contains(HasSubstr("environment map")));
}

TEST(EnvironmentMap, SecondMapIsRefused) {
  SceneBuilder builder = under_sky(SkyImage(8, 5, 1));
  test::add_sky(builder, SkyImage(8, 5, 2));
  EXPECT_THROW(test::world_of(builder), std::runtime_error);
}

}  // namespace
}  // namespace ls::render
