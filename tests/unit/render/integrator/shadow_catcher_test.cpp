// Tests of shadow catchers: the opacity of shadows in closed form, and what else the camera sees of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/significance.h"
#include "tests/unit/render/integrator/aov_picture.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr std::uint64_t kManySamples = 1024;

struct Alpha {
  double value = 0, error = 0;  // mean over the pixels, and its standard error
};
// Returns the alpha that an image has of the layers alpha and shadow_catcher: the opacity without shadows,
// and T (1 - L / U).
Alpha alpha_of(const Picture& p, std::uint64_t samples) {
  const auto of = [&](std::size_t i, std::string_view halves) {
    double light = 0, through = 0, unshadowed = 0, opacity = 0;
    for (const char h : halves) {
      light += p.sum(fmt::format("aov.shadow_catcher.{}.L", h), i);
      through += p.sum(fmt::format("aov.shadow_catcher.{}.T", h), i);
      unshadowed += p.sum(fmt::format("aov.shadow_catcher.{}.U", h), i);
      opacity += p.sum(fmt::format("aov.alpha.{}.A", h), i);
    }
    const double count = static_cast<double>(samples * halves.size()) / 2;
    return (opacity + (unshadowed > 0 ? through * (1 - light / unshadowed) : 0)) / count;
  };
  Alpha a;
  for (std::size_t i = 0; i < p.pixels(); ++i) {
    const double d = (of(i, "A") - of(i, "B")) / 2;
    a.value += of(i, "AB") / static_cast<double>(p.pixels());
    a.error += d * d;
  }
  a.error = std::sqrt(a.error) / static_cast<double>(p.pixels());
  return a;
}
Alpha alpha_of(const SceneBuilder& builder, std::uint64_t samples = kSamples) {
  return alpha_of(Picture(builder, {"alpha", "shadow_catcher"}, samples), samples);
}
double black(const Picture& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.pixels(); ++i)
    for (std::size_t c = 0; c < 3; ++c) sum += p.whole(c, i);
  return sum;
}

// A floor of side 40 in the plane z = 0, seen at the point (x, 0) alone from far above the side.
SceneBuilder floor_at(double x) {
  SceneBuilder builder({4, 4});
  builder.shape(RectangleShape{}, test::scale(20), builder.diffuse(.5)).shadow_catcher = true;
  builder.look({x, -30, 10}, {x, 0, 0}, 1e-3);
  builder.scene.film.transparent = true;
  return builder;
}
// A square of side 2 above the origin.
Shape& roof(SceneBuilder& builder, double height = 1) {
  return builder.shape(RectangleShape{}, translate({0, 0, height}), builder.diffuse(.5));
}
void add_sun(SceneBuilder& builder, const Vec3& direction) {
  builder.scene.emitters.emplace_back(DirectionalEmitter{direction, {1, 1, 1}});
}

TEST(ShadowCatcher, IsOpaqueInAShadowAndClearBesideIt) {
  for (const char* integrator : {"volpath", "path", "volpath_distant_mis", "whitted"})
    for (const double x : {0., 2.}) {
      SceneBuilder builder = floor_at(x);
      builder.scene.integrator.name = integrator;
      roof(builder);
      add_sun(builder, {0, 0, -1});

      const Picture p(builder, {"alpha", "shadow_catcher"});

      EXPECT_EQ(alpha_of(p, kSamples).value, x == 0) << integrator;
      EXPECT_EQ(black(p), 0) << integrator;
    }
}

// There are two equal lights, and the floor is in the shadow of one.
TEST(ShadowCatcher, IsHalfOpaqueWhereHalfOfTheLightIsMissing) {
  SceneBuilder builder = floor_at(0);
  roof(builder);
  add_sun(builder, {0, 0, -1});
  add_sun(builder, {2, 0, -1});
  std::get<DirectionalEmitter>(builder.scene.emitters[1]).irradiance = {
      std::sqrt(5), std::sqrt(5), std::sqrt(5)};  // times the cosine 1 / sqrt 5

  const Alpha a = alpha_of(builder, kManySamples);

  EXPECT_NEAR(a.value, .5, test::kStandardErrors * a.error + kClose);
  EXPECT_LT(a.error, .01);
}

// The light comes straight down through fog of depth 2, which the camera does not look through.
TEST(ShadowCatcher, ShowsTheShadowOfFog) {
  SceneBuilder builder = floor_at(0);
  builder.container(CubeShape{}, translate({0, 0, 9}), builder.null(),
                    builder.homogeneous({.4, .4, .4}, {.9, .9, .9}));
  add_sun(builder, {0, 0, -1});

  EXPECT_NEAR(alpha_of(builder).value, 1 - std::exp(-.8), 4 * kClose);
}

// Between camera and catcher fog of depth 2 covers the plate, and its shadow as well.
TEST(ShadowCatcher, IsCoveredByFogInFront) {
  SceneBuilder builder = floor_at(0);
  builder.look({0, 0, 30}, {0, 0, 0}, 1e-3, {0, 1, 0});
  builder.container(CubeShape{}, translate({0, 0, 5}), builder.null(),
                    builder.homogeneous({.4, .4, .4}, {0, 0, 0}));
  add_sun(builder, {1, 0, -1});  // passes beside the fog
  EXPECT_NEAR(alpha_of(builder).value, 1 - std::exp(-.8), 4 * kClose);

  builder.shape(RectangleShape{}, translate({-2, 0, 2}), builder.diffuse(.5));
  EXPECT_NEAR(alpha_of(builder).value, 1, 4 * kClose);
}

// A disk of radius r at the height h above a point takes r^2 / (r^2 + h^2) of the irradiance of a constant
// sky.
TEST(ShadowCatcher, ShowsTheShadowOfADiskUnderTheSky) {
  for (const bool image : {false, true}) {
    SceneBuilder builder = floor_at(0);
    builder.shape(DiskShape{}, translate({0, 0, 2}), builder.diffuse(.5));
    if (image)
      test::add_sky(builder, test::SkyImage(8, 4, 1));
    else
      builder.environment();

    const Alpha a = alpha_of(builder, kManySamples);

    EXPECT_NEAR(a.value, .2, test::kStandardErrors * a.error + kClose) << image;
    EXPECT_LT(a.error, .01);
  }
}

TEST(ShadowCatcher, LeavesTheShadowsOfOtherCatchersToThePlate) {
  SceneBuilder builder = floor_at(0);
  roof(builder).shadow_catcher = true;
  add_sun(builder, {0, 0, -1});
  EXPECT_EQ(alpha_of(builder).value, 0);

  roof(builder, 2);
  EXPECT_EQ(alpha_of(builder).value, 0) << "the upper roof casts its shadow on the lower one";
}

TEST(ShadowCatcher, FollowsWhoSeesWhat) {
  SceneBuilder builder = floor_at(0);
  Shape& shape = roof(builder);
  add_sun(builder, {0, 0, -1});
  shape.visible_shadow = false;
  EXPECT_EQ(alpha_of(builder).value, 0) << "no shadow";

  shape.visible_shadow = true;
  add_sun(builder, {2, 0, -1});
  std::get<DirectionalEmitter>(builder.scene.emitters[1]).visible_reflection = false;
  EXPECT_EQ(alpha_of(builder, kManySamples).value, 1) << "the other light lights no surface";
}

TEST(ShadowCatcher, IsAnOrdinaryShapeForAllOtherRays) {
  SceneBuilder builder = floor_at(0);
  builder.environment(.25);
  add_sun(builder, {0, 0, -1});
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * test::rotate_x(180), builder.mirror());
  builder.look({0, -3, .2}, {0, 0, 1}, 10);
  SceneBuilder plain = builder;
  plain.scene.shapes[0].shadow_catcher = false;
  EXPECT_EQ(Picture(builder, {"alpha"}).beauty(), Picture(plain, {"alpha"}).beauty()) << "in a mirror";

  builder.look({0, -30, 10}, {0, 0, 0}, 20);
  builder.scene.film.transparent = plain.scene.film.transparent = false;
  plain.scene.sensor = builder.scene.sensor;
  const Picture p(builder, {"alpha", "shadow_catcher"});
  EXPECT_EQ(p.beauty(), Picture(plain, {"alpha"}).beauty()) << "without a transparent film";
  EXPECT_EQ(p.of_all("aov.shadow_catcher.A.T"), 0);
}

TEST(ShadowCatcher, BehindAnObjectIsCovered) {
  SceneBuilder builder = floor_at(0);
  add_sun(builder, {0, 0, -1});
  builder.shape(SphereShape{}, translate({0, -3, 1}), builder.diffuse(.5));

  const Picture p(builder, {"alpha", "shadow_catcher"});

  EXPECT_EQ(alpha_of(p, kSamples).value, 1);
  EXPECT_EQ(p.of_all("aov.shadow_catcher.A.T"), 0);
}

}  // namespace
}  // namespace ls::render
