// The goniometric light: the directions in which the texels of its image shine, and its intensity there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/scene_builder.h"
#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;

constexpr int kSide = 4;

// The direction of a point of the unit square by Clarberg's equal-area map, in double, as in the section on
// spherical geometry of pbrt-v4's book.
V3d direction_of(double u, double v) {
  const double x = 2 * u - 1, y = 2 * v - 1, ax = std::abs(x), ay = std::abs(y), inside = 1 - (ax + ay);
  const double r = 1 - std::abs(inside), phi = (r == 0 ? 1 : (ay - ax) / r + 1) * M_PI / 4;
  const double sine = r * std::sqrt(2 - r * r);
  return {std::copysign(sine * std::cos(phi), x), std::copysign(sine * std::sin(phi), y),
          std::copysign(1 - r * r, inside)};
}

// An image whose texels are all different.
test::SkyImage image() {
  test::SkyImage s(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) s.set(x, y, {1. + x + kSide * y, .5 * (x + 1), .25 * (y + 1)});
  return s;
}
SceneBuilder shining(const test::SkyImage& s, GoniometricEmitter e = {}) {
  SceneBuilder builder;
  BitmapTexture t;
  t.file = test::add_image(builder, s);
  t.filter = TextureFilter::nearest;
  e.texture = SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(t));
  builder.scene.emitters.push_back(e);
  builder.shape(RectangleShape{}, test::scale(3), builder.diffuse(.5));
  return builder;
}
C3 arriving(const LightBench& b, const V3d& p) {
  const auto s = b.world->lights.sample(b.world->lights.choose(numbers(.5f, .5f, .5f)), b.at(p));
  return s ? s->radiance / s->pdf : C3(0);
}

TEST(Goniometric, EmitsInEachDirectionByItsTexel) {
  GoniometricEmitter e;
  e.intensity = {3, 2, 1};
  const LightBench b(shining(image(), e));
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (const double du : {.2, .5, .9})
        for (const double distance : {.5, 2.}) {
          const V3d p = direction_of((x + du) / kSide, (y + .6) / kSide) * distance;
          const double wanted[] = {3 * (1. + x + kSide * y), x + 1., .25 * (y + 1)};
          const C3 got = arriving(b, p);
          // Float32 rounding of squared distances and of the position relative to the scene's box.
          for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(got[c] * distance * distance, wanted[c], 3e-6 * wanted[c]) << x << " " << y;
        }
}

TEST(Goniometric, FollowsItsTransform) {
  GoniometricEmitter e;
  e.to_world = test::translate({1, 2, 3}) * test::rotate_x(90);  // +z becomes -y
  const LightBench b(shining(image(), e));
  // The four texels in the middle of the square surround +z: +x is to the right, +y below.
  EXPECT_NEAR(arriving(b, {1 + .1, 2 - 1, 3 + .05}).x * 1.0125, 1 + 2 + kSide * 2, 1e-4);
  EXPECT_NEAR(arriving(b, {1 - .1, 2 - 1, 3 + .05}).x * 1.0125, 1 + 1 + kSide * 2, 1e-4);
  EXPECT_NEAR(arriving(b, {1 + .1, 2 - 1, 3 - .05}).x * 1.0125, 1 + 2 + kSide * 1, 1e-4);
  EXPECT_EQ(arriving(b, {1, 2, 3}), C3(0)) << "in it";
}

// Of directions spread evenly over the sphere, texels of equal solid angle get equally many. With a lattice
// of 200,000 points the error arises along the edges of texels, which a few hundred points are close to.
TEST(Goniometric, GivesEveryTexelTheSameSolidAngle) {
  constexpr int kPoints = 200000;
  std::array<int, kSide * kSide> count{};
  const LightBench b(shining(image()));
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1 - (2. * i + 1) / kPoints, s = std::sqrt(1 - z * z), a = i * 2.399963229728653;
    const V2 at = equal_area_place(V3(V3d(s * std::cos(a), s * std::sin(a), z)));
    ASSERT_TRUE(at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1);
    const int x = std::min(static_cast<int>(at.x * kSide), kSide - 1),
              y = std::min(static_cast<int>(at.y * kSide), kSide - 1);
    ++count[static_cast<std::size_t>(y * kSide + x)];
  }
  for (const int n : count) EXPECT_NEAR(n, kPoints / (kSide * kSide), 300);
}

TEST(Goniometric, MapsThePolesAndAxesToTheirPlaces) {
  const auto expect = [](const V3& w, float u, float v) {
    const V2 at = equal_area_place(w);
    EXPECT_NEAR(at.x, u, 1e-6f);
    EXPECT_NEAR(at.y, v, 1e-6f);
  };
  expect({0, 0, 1}, .5f, .5f);
  expect({1, 0, 0}, 1, .5f);
  expect({-1, 0, 0}, 0, .5f);
  expect({0, 1, 0}, .5f, 1);
  expect({0, -1, 0}, .5f, 0);
  const V2 below = equal_area_place({0, 0, -1});
  EXPECT_EQ(std::abs(below.x - .5f), .5f);
  EXPECT_EQ(std::abs(below.y - .5f), .5f);
}

TEST(Goniometric, BlackImageIsLeftOut) {
  const LightBench b(shining(test::SkyImage(2, 2)));
  EXPECT_FALSE(b.world->lights.can_sample());
  EXPECT_EQ(b.world->lights.left_out(), 1u);
}

TEST(Goniometric, RequiresASquareImage) {
  const SceneBuilder builder = shining(test::SkyImage(4, 2));
  const auto world = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("the image of a goniometric light is not square"), std::string::npos)
      << world.error().message;
}

}  // namespace
}  // namespace ls::render
