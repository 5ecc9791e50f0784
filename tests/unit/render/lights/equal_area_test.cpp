// Square environment maps of pbrt-v4: the directions of texels, and the light that they give.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/jacobian.h"
#include "tests/unit/render/envmap_builder.h"
#include "worker/render/math/equal_area.h"
#include "worker/render/math/random.h"

namespace ls::render {
namespace {

using test::SkyImage;
using ::testing::HasSubstr;

constexpr double kPiBook = std::numbers::pi;
// The solid angle of a texel times the number of texels.
constexpr double kWholeSphere = 4 * kPiBook;

Result<EnvironmentMap> try_square_map(const SkyImage& s, double scale = 1, const Transform& t = {}) {
  return EnvironmentMap::build("sky.pfm", data(s), scale, t, SkyMapping::equal_area);
}
EnvironmentMap square_map(const SkyImage& s, double scale = 1, const Transform& t = {}) {
  auto m = try_square_map(s, scale, t);
  if (!m) throw std::runtime_error(m.error().message);
  return std::move(*m);
}

// The direction of a place by the formulas of Pharr, Jakob and Humphreys ("Physically Based Rendering", 4th
// edition, section 3.8.3), in double. They use the signed distance to the diagonal; the renderer folds the
// square instead.
V3d book_direction(double px, double py) {
  const double u = 2 * px - 1, v = 2 * py - 1, distance = 1 - (std::abs(u) + std::abs(v));
  const double r = 1 - std::abs(distance);
  const double phi = r == 0 ? 0 : ((std::abs(v) - std::abs(u)) / r + 1) * kPiBook / 4;
  const double radius = r * std::sqrt(2 - r * r);
  return {std::copysign(std::cos(phi) * radius, u), std::copysign(std::sin(phi) * radius, v),
          std::copysign(1 - r * r, distance)};
}

TEST(EqualArea, AxesMatchPbrt) {
  const auto place = [](float x, float y, float z) { return equal_area_place({x, y, z}); };
  const auto is = [](const V2& p, float x, float y) { return p.x == x && p.y == y; };
  EXPECT_TRUE(is(place(0, 0, 1), .5f, .5f));
  EXPECT_TRUE(is(place(1, 0, 0), 1, .5f));
  EXPECT_TRUE(is(place(-1, 0, 0), 0, .5f));
  EXPECT_TRUE(is(place(0, 1, 0), .5f, 1));
  EXPECT_TRUE(is(place(0, -1, 0), .5f, 0));
  const V2 below = place(0, 0, -1);
  EXPECT_TRUE((below.x == 0 || below.x == 1) && (below.y == 0 || below.y == 1));
}

TEST(EqualArea, DirectionsMatchTheFormulaInTheBook) {
  for (int i = 0; i <= 64; ++i)
    for (int j = 0; j <= 64; ++j) {
      const V3 d = equal_area_direction({static_cast<float>(i) / 64, static_cast<float>(j) / 64});
      const V3d want = book_direction(i / 64., j / 64.);
      // The error of a few float32 roundings of numbers up to 1.
      EXPECT_LT((V3d(d) - want).length(), 0x1p-21) << i << " " << j;
    }
}

TEST(EqualArea, MappingAndItsInverseAgree) {
  RandomStream r(5);
  for (int i = 0; i < 100000; ++i) {
    const V2 p(r.uniform(), r.uniform()), back = equal_area_place(equal_area_direction(p));
    // On the border one direction has two places, so places close to it are skipped. Elsewhere places change
    // less than directions, whose error is 2^-21.
    if (std::min(p.x, p.y) < 1e-6f || std::max(p.x, p.y) > 1 - 1e-6f) continue;
    EXPECT_NEAR(back.x, p.x, 0x1p-21) << p.x << " " << p.y;
    EXPECT_NEAR(back.y, p.y, 0x1p-21) << p.x << " " << p.y;
  }
}

TEST(EqualArea, PreservesAreas) {
  test::expect_jacobian("equal area", [](const V2& u) -> std::optional<test::Mapped> {
    return test::Mapped{V3d(equal_area_direction(u)), 1 / kWholeSphere};
  });
}

// Texels are not filtered: a direction that is not next to a texel's edge has exactly that texel's radiance.
TEST(EqualArea, TexelsAreAtTheirPositions) {
  constexpr int kSide = 7;
  SkyImage s(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) s.set(x, y, {1. + x, 1. + y, 1});
  const EnvironmentMap m = square_map(s, 3);
  RandomStream r(6);
  for (int i = 0; i < 20000; ++i) {
    const double x = r.uniform() * kSide, y = r.uniform() * kSide;
    if (std::abs(x - std::round(x)) < 1e-5 || std::abs(y - std::round(y)) < 1e-5) continue;
    const C3 got = m.at(V3(book_direction(x / kSide, y / kSide))).radiance;
    EXPECT_EQ(got,
              C3(3 * (1 + std::floor(static_cast<float>(x))), 3 * (1 + std::floor(static_cast<float>(y))), 3))
        << x << " " << y;
  }
}

TEST(EqualArea, SixAxesHaveTheirColours) {
  SkyImage s(9, 9);
  s.set(4, 4, {1, 0, 0});  // +z
  s.set(8, 4, {2, 0, 0});  // +x
  s.set(0, 4, {3, 0, 0});
  s.set(4, 8, {4, 0, 0});  // +y
  s.set(4, 0, {5, 0, 0});
  for (const int x : {0, 8})
    for (const int y : {0, 8}) s.set(x, y, {6, 0, 0});  // -z
  const auto red = [](const EnvironmentMap& m, const V3& d) { return m.at(d).radiance.x; };
  const EnvironmentMap m = square_map(s);
  EXPECT_EQ(red(m, {0, 0, 1}), 1);
  EXPECT_EQ(red(m, {1, 0, 0}), 2);
  EXPECT_EQ(red(m, {-1, 0, 0}), 3);
  EXPECT_EQ(red(m, {0, 1, 0}), 4);
  EXPECT_EQ(red(m, {0, -1, 0}), 5);
  EXPECT_EQ(red(m, {0, 0, -1}), 6);
  // A quarter turn about x takes +y to +z and +z to -y.
  const EnvironmentMap turned = square_map(s, 1, test::rotate_x(90));
  EXPECT_EQ(red(turned, {0, 0, 1}), 4);
  EXPECT_EQ(red(turned, {0, -1, 0}), 1);
  EXPECT_EQ(red(turned, {1, 0, 0}), 2);
}

// The integral of direction times radiance (red) over all directions, by stratified samples of the map. If
// all light is above a plane, the irradiance of the plane is the product of this vector and the normal.
V3d light_flow(
    const EnvironmentMap& m, const std::function<bool(const V3&)>& counts = [](const V3&) { return true; }) {
  constexpr int kSide = 512;
  RandomStream r(4);
  V3d sum(0, 0, 0);
  for (int i = 0; i < kSide * kSide; ++i) {
    const auto word = [&](int k) {
      return static_cast<std::uint32_t>((static_cast<double>(k) + r.uniform()) / kSide * 0x1p32);
    };
    const std::uint32_t x = word(i % kSide), y = word(i / kSide);
    const V3 d = m.sample(x, y);
    const EnvironmentMap::Light l = m.at(d);
    // Next to a texel's edge a rounded direction may lie in the neighbouring texel, which may be black.
    if (counts(d) && l.pdf > 0) sum += V3d(d) * double{l.radiance.x / l.pdf};
  }
  return sum / double{kSide} / double{kSide};
}
bool is_above_square(const V3& d) { return d.z > 0; }
// Light over density is the map's flux, at most 8 pi here, and z changes by 1 / 512 of its range of 2 within
// a stratum. The standard deviation of the mean of 512^2 such independent errors is that divided by 512; the
// limit is three times as large.
constexpr double kStrataError = 3 * 8 * kPiBook * 2 / (512. * 512);

TEST(EqualArea, ConstantMapHasItsIrradianceAndIsSampledUniformly) {
  const EnvironmentMap m = square_map(SkyImage(6, 6, 2));
  EXPECT_NEAR(m.flux(), 2 * kWholeSphere, 1e-5);  // float32 weights of the luminance
  EXPECT_NEAR(m.at({0, .6f, .8f}).pdf * kWholeSphere, 1, 1e-6);
  EXPECT_NEAR(light_flow(m, is_above_square).z, 2 * kPiBook, kStrataError);
}

TEST(EqualArea, HemisphereHasIrradiancePi) {
  // Half of each texel on the fold is in the lit hemisphere, so it has half of the radiance. The half of the
  // light that these texels lack above the fold lies within 2 / side of it: 8 pi / (3 side^2), as derived
  // below.
  constexpr int kSide = 32;
  SkyImage s(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const int l1 = std::abs(2 * x + 1 - kSide) + std::abs(2 * y + 1 - kSide);
      const double v = l1 < kSide ? 1 : l1 == kSide ? .5 : 0;
      s.set(x, y, {v, v, v});
    }
  const EnvironmentMap m = square_map(s);
  // 2 side halves of texels, of the solid angle 2 pi / side^2 each, are above the fold. There z = 1 - r^2 is
  // about 2 (1 - r), whose mean over a triangle is 2 x (2 / side) / 3.
  const double lacking = .5 * (2 * kSide) * (2 * kPiBook / (kSide * kSide)) * 4 / (3. * kSide);
  // The relative error of z = 2 (1 - r) is below 1 / 16 there.
  EXPECT_NEAR(light_flow(m, is_above_square).z, kPiBook - lacking, lacking / 16 + kStrataError);
  EXPECT_NEAR(m.flux(), kWholeSphere / 2, 1e-5);
}

TEST(EqualArea, CosineMapHasIrradianceTwoThirdsOfPi) {
  // A texel has the side h = 2 / side in s. The z of its centre exceeds its mean z by h^2 / 6. Its mean z^2
  // exceeds the square of its mean z by 2 r^2 h^2 / 3, because z = 1 - r^2 has the slope 2 r along each axis.
  // In all, the irradiance is 2 pi / side^2 below that of the smooth map.
  constexpr int kSide = 32;
  SkyImage s(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double z = std::max(0., book_direction((x + .5) / kSide, (y + .5) / kSide).z);
      s.set(x, y, {z, z, z});
    }
  const double want = 2 * kPiBook / 3 - 2 * kPiBook / (kSide * kSide);
  // The 2 side texels on the fold are black, since z is 0 at their centres. In the smooth map z^2 above the
  // fold is 4 (1 - r)^2 there, and its mean over a triangle is 4 (2 / side)^2 / 6.
  const double fold = 2 * kSide * (2 * kPiBook / (kSide * kSide)) * 8 / (3. * kSide * kSide);
  EXPECT_NEAR(light_flow(square_map(s), is_above_square).z, want, fold + kStrataError);
}

TEST(EqualArea, SingleBrightTexelHasItsIrradiance) {
  constexpr int kSide = 16;
  // Texels next to the centre, within a quadrant, across the fold, at the middle of an edge, in a corner, and
  // at the border
  for (const auto& [x, y] : {std::pair{7, 7}, {10, 6}, {3, 4}, {15, 8}, {0, 15}, {2, 0}}) {
    SkyImage s(kSide, kSide);
    s.set(x, y, {1000, 1000, 1000});
    const EnvironmentMap m = square_map(s);
    V3d want(0, 0, 0);
    constexpr int kParts = 64;
    for (int i = 0; i < kParts; ++i)
      for (int j = 0; j < kParts; ++j)
        want += book_direction((x + (i + .5) / kParts) / kSide, (y + (j + .5) / kParts) / kSide);
    want = want * (1000 * kWholeSphere / (kSide * kSide) / (kParts * kParts));
    // The errors of midpoints and of strata are both below 1 / 64^2 / 24 of the spread of directions in a
    // texel, which is .3; the rest is float32 rounding.
    EXPECT_LT((light_flow(m) - want).length(), 2e-5 * want.length()) << x << " " << y;
  }
}

// In a stratified square of words, the strata of rows and of columns that choose a texel match its share to
// within one stratum each.
TEST(EqualArea, TexelsAreSampledByTheirDensity) {
  constexpr int kSide = 5, kWords = 1024;
  SkyImage s(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double v = y == 2 ? 0 : (x * 7 + y * 3) % 5;  // one black row, and some black texels
      s.set(x, y, {v, v, v});
    }
  const EnvironmentMap m = square_map(s);
  std::array<int, kSide * kSide> got{};
  for (std::uint32_t a = 0; a < kWords; ++a)
    for (std::uint32_t b = 0; b < kWords; ++b) {
      const V2 p = equal_area_place(m.sample(a << 22 | 1u << 21, b << 22 | 1u << 21));
      ++got.at(static_cast<std::size_t>(p.y * kSide) * kSide + static_cast<std::size_t>(p.x * kSide));
    }
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const EnvironmentMap::Light l = m.at(V3(book_direction((x + .5) / kSide, (y + .5) / kSide)));
      const double share = l.pdf * kWholeSphere / (kSide * kSide) * kWords * kWords;
      EXPECT_NEAR(got.at(static_cast<std::size_t>(y * kSide + x)), share, 2 * kWords + 1) << x << " " << y;
      EXPECT_EQ(l.pdf > 0, l.radiance.x > 0) << x << " " << y;
    }
}

TEST(EqualArea, TheSmallestMapIsOneTexel) {
  const EnvironmentMap m = square_map(SkyImage(1, 1, 3));
  for (const std::uint32_t word : {0u, 0x80000000u, 0xffffffffu}) {
    const V3 d = m.sample(word, word);
    EXPECT_NEAR(dot(d, d), 1, 1e-6f);
    EXPECT_EQ(m.at(d).radiance.x, 3);
    EXPECT_NEAR(m.at(d).pdf * kWholeSphere, 1, 1e-6);
  }
}

TEST(EqualArea, OnlySquareImagesAreAccepted) {
  EXPECT_THAT(try_square_map(SkyImage(8, 4, 1)).error().message,
              HasSubstr("'sky.pfm' has 8 x 4 pixels; an equal-area map is square"));
  ImageData huge;
  huge.width = huge.height = 8192;
  huge.channels = 3;
  EXPECT_EQ(EnvironmentMap::build("sky.pfm", huge, 1, {}, SkyMapping::equal_area).error().code,
            Errc::resource_exhausted);
}

}  // namespace
}  // namespace ls::render
