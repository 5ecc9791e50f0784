// Fog that falls with height: its integral along rays, and the inverse of that.
#include "worker/render/media/height_fog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/render/media/emission.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/optical_depth.h"

namespace ls::render {
namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

// A ray whose origin has this level, and whose level rises by `climb` per unit of distance.
HeightRay ray(double level, double climb) {
  HeightProfile fog;
  fog.base = level;
  fog.rise = {0, 0, climb};
  return {fog, {0, 0, 0}, {0, 0, 1}};
}

struct Row {
  double level, climb, t, depth;
};
// Computed by mpmath 1.3 with 60 digits, from the antiderivatives below and above the ground
constexpr Row kExact[] = {
    {3, -1, 1e7, 9999997.9502129316},
    {40, 1, kForever, 4.248354255291589e-18},
    {0.25, 1e-30, 0.5, 0.38940039153570243},
    {-1e6, -1e-12, 10, 10.0},
    {1e-7, 1e-12, kForever, 999999900000.00502},
    {-0.25, 1, kForever, 1.25},
    {0.25, 1e-12, 10, 7.7880078306751086},
    {0, 0.1, kForever, 9.9999999999999994},
    {0, 1e-12, kForever, 1000000000000.0},
    {-1e6, 1e-30, 10, 10.0},
    {-1e-7, 1e-12, 10, 10.0},
    {3, 0.1, kForever, 0.4978706836786394},
    {0, -1e6, 1e7, 10000000.0},
    {-0.25, -0.1, 1e7, 10000000.0},
    {1e-7, 0.1, 0.5, 0.48770570622228685},
    {-1e-7, 1, 10, 0.99995470006569752},
    {40, 0.1, 10, 2.6854720659566002e-17},
    {3, 1e6, kForever, 4.9787068367863943e-8},
    {-0.25, -1e-12, 10, 10.0},
    {0.25, 1e-30, 1e7, 7788007.8307140487},
    {3, -1e-30, 1e7, 497870.68367863943},
    {-0.25, 0.1, 1e7, 12.499999999999999},
    {0, -1e-12, 1e7, 10000000.0},
    {3, -1e-30, 10, 0.49787068367863943},
    {3, 1e6, 10, 4.9787068367863943e-8},
    {-0.25, 0, 1e7, 10000000.0},
    {-0.25, 1e-12, 10, 10.0},
    {40, -1, 1e7, 9999961.0},
    {-1e6, 1, 0.5, 0.5},
    {0.25, -1, 1e7, 9999999.9711992169},
    {-1e-7, -0.1, 1e7, 10000000.0},
    {40, -1e-30, 1e7, 4.248354255291589e-11},
    {-1e6, 1e-12, 10, 10.0},
    {1e-7, 1e6, 0.5, 9.99999900000005e-7},
    {3, -1e-12, 1e7, 497873.17304035569},
    {-0.25, 1e-30, 10, 10.0},
    {3, -1e-12, 10, 0.49787068368112878},
    {1e-7, 1e-12, 0.5, 0.4999999499998775},
    {3, -1e6, 10, 9.9999979502129316},
    {0.25, 1e-12, 0.5, 0.38940039153560508},
    {-1e-7, 1e-12, 0.5, 0.5},
    {40, 1, 10, 4.2481613803067926e-18},
    {0, 1, kForever, 1.0},
    {3, -0.1, 0.5, 0.025526375805684501},
    {-1e-7, -1e-30, 1e7, 10000000.0},
    {40, 1e-12, 0.5, 2.1241771276452635e-18},
    {1e-7, 1e6, 10, 9.99999900000005e-7},
    {-1e6, 0, 0.5, 0.5},
};

TEST(HeightRay, IntegratesTheDensity) {
  for (const Row& row : kExact)
    // A few roundings of double, relative; near the level 3e8 of e^-x the argument's own rounding is below
    // that
    EXPECT_NEAR(ray(row.level, row.climb).depth(row.t), row.depth, 1e-15 * 8 * row.depth)
        << row.level << " " << row.climb << " " << row.t;
}

TEST(HeightRay, HasNoEndOfFogWhereItDoesNotRise) {
  for (const double climb : {0., -1e-30, -1.})
    for (const double level : {-1e6, 0., 3., 600.}) EXPECT_EQ(ray(level, climb).depth(kForever), kForever);
  EXPECT_EQ(ray(1e4, 0).depth(kForever), 0) << "so high that there is none in double";
}

// distance() is the inverse of depth(). A relative error e of the depth moves the distance by e * depth /
// density. The level of a point is rounded to half of 2^-52 of itself, which is an error of that much of the
// density, relative, and both functions make it.
TEST(HeightRay, InvertsTheIntegral) {
  for (const double level : {-1e6, -.25, -1e-7, 0., 1e-7, .25, 3., 40., 300.})
    for (const double climb : {1., -1., 1e-12, -1e-12, 1e-30, -1e-30, 0., 1e6, -1e6, .1, -.1})
      for (const double t : {1e-9, .5, 10., 1e5}) {
        const HeightRay r = ray(level, climb);
        const double depth = r.depth(t), density = r.density(t);
        if (!(density > 1e-12 * r.density(0))) continue;  // nothing of the depth's digits tells of t
        EXPECT_NEAR(r.distance(depth), t, (1e-14 + 0x1p-52 * std::abs(level)) * (t + depth / density))
            << level << " " << climb << " " << t;
      }
}

TEST(HeightRay, NeverReachesMoreThanThereIs) {
  EXPECT_EQ(ray(0, 1).distance(1), kForever);
  EXPECT_EQ(ray(0, 1).distance(1e9), kForever);
  EXPECT_EQ(ray(-2, 1).distance(3.0000001), kForever);
  EXPECT_EQ(ray(2000, 1).distance(1e-30), kForever);
  EXPECT_LT(ray(0, 1).distance(1 - 0x1p-53), 40);
}

TEST(HeightRay, StaysFiniteFromAnyHeight) {
  // Down from the level 1e6 to the ground: the whole fog lies at its end.
  const HeightRay down = ray(1e6, -1);
  EXPECT_EQ(down.depth(10), 0);
  EXPECT_DOUBLE_EQ(down.depth(1e6), 1);
  EXPECT_NEAR(down.distance(.5), 1e6 + std::log(.5), 1e-9);
  EXPECT_DOUBLE_EQ(down.distance(11), 1e6 + 10);
  // Up from far below the ground
  EXPECT_DOUBLE_EQ(ray(-1e6, 1).depth(kForever), 1e6 + 1);
  for (const double level : {-1e300, -1e6, 0., 1e6, 1e300})
    for (const double climb : {-1e300, -1e6, -1e-300, 0., 1e-300, 1e6, 1e300})
      for (const double t : {0., 1e-30, 1., 1e30, kForever}) {
        const HeightRay r = ray(level, climb);
        EXPECT_FALSE(std::isnan(r.depth(t))) << level << " " << climb << " " << t;
        EXPECT_GE(r.depth(t), 0);
        EXPECT_FALSE(std::isnan(r.density(t)));
        EXPECT_FALSE(std::isnan(r.distance(t))) << level << " " << climb << " " << t;
        EXPECT_GE(r.distance(t), 0);
      }
}

Medium fog_of(const C3& sigma_t, const C3& albedo) {
  Medium m;
  m.sigma_t = sigma_t;
  m.sigma_s = sigma_t * albedo;
  m.height.emplace();
  m.height->rise = {0, 0, 2};
  m.height->base = -.5;
  return m;
}
constexpr Features kGrey{.media = true, .height = true};
constexpr Features kChromatic{.media = true, .chromatic = true, .height = true};

// The probability that a flight escapes is the transmittance, also up into the sky: with sigma 1.5 and the
// depth 1/4 + 1/2 it is e^-1.125.
TEST(HeightFog, FlightsEscapeWithTheProbabilityOfTransmittance) {
  const Medium m = fog_of(C3(1.5f), C3(1));
  const V3 o(0, 0, 0), d(0, 0, 1);
  RandomStream stream(7);
  EXPECT_NEAR(transmittance<kGrey>(m, o, d, 0, kInfinity, stream).x, std::exp(-1.125), 1e-6);
  constexpr int kFlights = 1 << 16;
  MediumCounters counters;
  int escaped = 0;
  double mean = 0;
  for (int i = 0; i < kFlights; ++i) {
    const std::uint32_t bits = stream.bits();
    const Flight f = free_flight<kGrey>(m, 0, bits, o, d, kInfinity, stream, counters);
    escaped += !f.scattered;
    if (f.scattered) mean += m.height->density(V3d(o + d * f.t));
  }
  const double p = std::exp(-1.125);
  // Five standard errors
  EXPECT_NEAR(static_cast<double>(escaped) / kFlights, p, 5 * std::sqrt(p * (1 - p) / kFlights));
  // The mean density at the ends: below the ground 1 - e^(-1.5/4) of flights end at the density 1; above it
  // the integral of rho * s rho e^(-s x) dt over the depth x, with rho = 1 - 2 y at the depth y above the
  // ground.
  const double s = 1.5, below = -std::expm1(-s * .25);
  double above = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double y = (i + .5) / kSteps * .5;
    above += (1 - 2 * y) * s * std::exp(-s * (.25 + y)) * .5 / kSteps;
  }
  EXPECT_NEAR(mean / kFlights, below + above, 5 * .5 / std::sqrt(kFlights));
}

// Averaged over the heroes by the balance heuristic, the weights of flights that escape, and of those that
// scatter, are the transmittance and what is scattered of each channel.
TEST(HeightFog, FlightsOfColouredFogAreRightInEachChannel) {
  const Medium m = fog_of({.5f, 1.5f, 6}, {.9f, .5f, .2f});
  const V3 o(0, 0, 1), d = normalize(V3(1, 0, -.5f));
  constexpr float kEnd = 3;
  RandomStream stream(3);
  const C3 through = transmittance<kChromatic>(m, o, d, 0, kEnd, stream);
  constexpr int kFlights = 1 << 16;
  V3d escaped(0), scattered(0), escaped2(0), scattered2(0);
  MediumCounters counters;
  for (int i = 0; i < kFlights; ++i) {
    const std::uint32_t bits = stream.bits();
    const Flight f = free_flight<kChromatic>(m, i % 3, bits, o, d, kEnd, stream, counters);
    const V3d w = V3d(f.weight) / ((f.density.x + f.density.y + f.density.z) / 3);
    (f.scattered ? scattered : escaped) += w;
    (f.scattered ? scattered2 : escaped2) += w * w;
  }
  for (int c = 0; c < 3; ++c) {
    const auto error = [&](double sum, double squares) {
      const double mean = sum / kFlights;
      return 5 * std::sqrt(std::max(0., squares / kFlights - mean * mean) / kFlights);
    };
    const double t = through[c], albedo = m.sigma_s[c] / m.sigma_t[c];
    EXPECT_NEAR(escaped[c] / kFlights, t, error(escaped[c], escaped2[c]));
    EXPECT_NEAR(scattered[c] / kFlights, albedo * (1 - t), error(scattered[c], scattered2[c]));
  }
}

TEST(HeightFog, OpticalDepthIsExact) {
  const Medium m = fog_of(C3(2), C3(1));
  const V3 o(0, 0, 2), d(0, 0, -1);
  const OpticalDepth depths(m, o, d, 5);
  const HeightRay exact(*m.height, o, d);
  EXPECT_FLOAT_EQ(depths.total(), static_cast<float>(exact.depth(5)));
  for (const float t : {.1f, 1.f, 1.7f, 3.f, 4.9f}) {
    const DepthPoint p = depths.at(t);
    EXPECT_FLOAT_EQ(p.x, static_cast<float>(exact.depth(t)));
    EXPECT_FLOAT_EQ(p.rate, static_cast<float>(exact.density(t)));
    EXPECT_NEAR(depths.after(p.x).t, t, 1e-6 * (t + p.x / p.rate));
  }
  const float at[] = {.5f, 1, 2};
  double x[3];
  depths.at_each(at, x);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(x[i], exact.depth(at[i]));
}

TEST(HeightFog, HasNothingWhereRoundingPutsAPointAtItsEnd) {
  const Medium m = fog_of(C3(2), C3(1));
  const OpticalDepth depths(m, {0, 0, 0}, {0, 0, 1}, kInfinity);
  const DepthPoint end = depths.after(depths.total());
  EXPECT_TRUE(std::isfinite(end.t));
  EXPECT_EQ(end.rate, 0);
}

// Light in proportion to absorption: j (1 - e^(-s x)) / s over the depth x.
TEST(HeightFog, EmissionHasAClosedForm) {
  Medium m = fog_of({2, 2, 0}, C3(0));
  m.emission = {3, 1, 0};
  const V3 o(0, 0, 0), d(0, 0, 1);
  const double x = .75;
  const C3 up = emission_of_height(m, o, d, kInfinity);
  EXPECT_FLOAT_EQ(up.x, static_cast<float>(3 * -std::expm1(-2 * x) / 2));
  EXPECT_FLOAT_EQ(up.y, static_cast<float>(-std::expm1(-2 * x) / 2));
  EXPECT_EQ(up.z, 0);
}

}  // namespace
}  // namespace ls::render
