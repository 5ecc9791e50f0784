// Perlin noise, and pbrt's clouds, which are made of it.
#include "formats/pbrt/cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace ls::scene::pbrt {
namespace {

Vec3 vec(double x, double y, double z) { return Vec3{{x, y, z}}; }

// The first value is that of Perlin's own program (improved noise, 2002), which others often use as a test;
// the gradients that pbrt has changed do not matter at this point. The other values are those of a separate
// program that follows Perlin's with pbrt's 16 gradients.
TEST(Noise, HasKnownValues) {
  EXPECT_NEAR(noise(vec(3.14, 42, 7)), 0.13691995878400012, 1e-14);
  EXPECT_NEAR(noise(vec(.5, .5, .5)), -0.125, 1e-14);
  EXPECT_NEAR(noise(vec(1.25, 2.5, 3.75)), -0.03836345672607422, 1e-14);
  EXPECT_NEAR(noise(vec(-7.3, 100.6, .2)), 0.19408821373829105, 1e-13);
  EXPECT_NEAR(noise(vec(255.9, -1.1, 511.35)), 0.18592218705960284, 1e-12);
  EXPECT_NEAR(noise(vec(12.4, .7, 31.6)), -0.26998342216089716, 1e-13);
}

TEST(Noise, IsZeroAtWholeNumbersAndRepeatsAfter256) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> random(-4, 4);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = vec(random(rng), random(rng), random(rng));
    EXPECT_EQ(noise(vec(std::floor(p[0]), std::floor(p[1]), std::floor(p[2]))), 0);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 q = p;
      q[k] += 256;
      // p + 256 is rounded by 2^-45, and the slope is at most 8: see kSlope below.
      EXPECT_NEAR(noise(q), noise(p), 8 * 0x1p-45);
    }
  }
}

TEST(Noise, InvalidPositionsGiveZero) {
  for (const double x : {1e30, -1e300, HUGE_VAL, -HUGE_VAL, std::nan("")}) {
    EXPECT_EQ(noise(vec(x, 0, 0)), 0) << x;
    EXPECT_TRUE(std::isfinite(noise_slope(vec(0, x, .5))[1])) << x;
  }
}

// Bounds of the first and second derivative of noise along an axis. Along an axis noise is (1 - w) a + w b
// with Perlin's weight w. a and b are means of g . d, where the gradient g has two elements of +-1 and d is
// within [-1, 1]^3. So |a|, |b| <= 2 and |a'|, |b'| <= 1. Perlin's weight has |w'| <= 15/8 and |w''| <= 10 /
// sqrt 3 < 5.78. So the first derivative is at most 15/8 * 4 + 1, and the second at most 5.78 * 4 + 2 * 15/8
// * 2.
constexpr double kSlope = 8.5, kBend = 30.7;

// Linear interpolation between nodes at the distance h errs, along each axis, by at most h^2 / 8 times the
// second derivative. With wispiness 0 the density before clamping is (1 - y) 4.5 density f(p) + max(0, 1 - 2
// y), where f is the sum of octaves of noise, so its second derivatives follow from the bounds above. The
// cloud's box begins at the height 1/2, above which the second term is 0. Only points are tested around which
// all nodes are within (0, 1), where the density is not clamped.
TEST(Cloud, GridMatchesTheFormulaWithinInterpolationError) {
  Cloud cloud;
  cloud.density = .7;
  cloud.wispiness = 0;
  cloud.frequency = 1.5;
  cloud.low = vec(.2, .5, -.3);
  cloud.high = vec(.9, 1, .4);
  double slope = 0, bend = 0;
  for (int i = 0; i < 5; ++i) {
    const double octave = std::pow(1.99, i) * cloud.frequency, strength = std::pow(.5, i + 1);
    slope += strength * octave * kSlope;
    bend += strength * octave * octave * kBend;
  }
  const double factor = 4.5 * cloud.density * .5;  // 1 - y is at most 1/2
  const double bends[3] = {factor * bend, factor * bend + 2 * 4.5 * cloud.density * slope, factor * bend};

  const auto nodes = nodes_for(cloud, std::size_t{1} << 22);
  ASSERT_TRUE(nodes);
  EXPECT_EQ(nodes->per_cell, kWantedPerCell);
  const MadeGrid grid = cloud_grid(cloud, *nodes);
  double bound = 0x1p-24;  // values are float32
  for (std::size_t k = 0; k < 3; ++k) {
    const double h = (cloud.high[k] - cloud.low[k]) / (grid.sides[k] - 1);
    bound += h * h / 8 * bends[k];
  }
  ASSERT_LT(bound, .5);  // a larger bound would make the test meaningless

  std::mt19937 rng(7);
  std::uniform_real_distribution<double> random(0, 1);
  int asked = 0;
  double largest = 0;
  for (int i = 0; i < 20000; ++i) {
    std::size_t cell[3];
    double f[3];
    Vec3 p;
    for (std::size_t k = 0; k < 3; ++k) {
      const double t = random(rng) * (grid.sides[k] - 1);
      cell[k] = std::min(static_cast<std::size_t>(t), static_cast<std::size_t>(grid.sides[k] - 2));
      f[k] = t - static_cast<double>(cell[k]);
      p[k] = cloud.low[k] + t / (grid.sides[k] - 1) * (cloud.high[k] - cloud.low[k]);
    }
    double value = 0;
    bool clamped = false;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const std::size_t x = cell[0] + corner % 2, y = cell[1] + corner / 2 % 2, z = cell[2] + corner / 4;
      const float node = grid.values[(z * std::size_t(grid.sides[1]) + y) * std::size_t(grid.sides[0]) + x];
      clamped |= !(node > 0 && node < 1);
      value += node * (corner % 2 ? f[0] : 1 - f[0]) * (corner / 2 % 2 ? f[1] : 1 - f[1]) *
               (corner / 4 ? f[2] : 1 - f[2]);
    }
    if (clamped) continue;
    ++asked;
    const double error = std::abs(value - density_at(cloud, p));
    ASSERT_LE(error, bound) << p[0] << " " << p[1] << " " << p[2];
    largest = std::max(largest, error);
  }
  EXPECT_GT(asked, 1000);
  EXPECT_GT(largest, 0);
}

TEST(Cloud, IsDenseBelowAndEmptyAtHeightOne) {
  Cloud cloud;
  for (const double x : {.1, .37, 5.5}) {
    EXPECT_EQ(density_at(cloud, vec(x, 0, x)), 1);
    EXPECT_EQ(density_at(cloud, vec(x, -3, x)), 1);
    EXPECT_EQ(density_at(cloud, vec(x, 1, x)), 0);
  }
  // As in pbrt the formula is not cut off at height 1. Above it the cloud is dense where noise is negative.
  double above = 0;
  for (const double x : {.1, .37, 5.5}) above = std::max(above, density_at(cloud, vec(x, 7, x)));
  EXPECT_GT(above, 0);
  // With density 0, only the second term of the formula remains: 1 - 2 y, at least 0.
  cloud.density = 0;
  EXPECT_DOUBLE_EQ(density_at(cloud, vec(.3, .2, .4)), .6);
  EXPECT_EQ(density_at(cloud, vec(.3, .6, .4)), 0);
}

TEST(Cloud, WispinessDisplacesPointsByTheGradientOfNoise) {
  Cloud plain, wispy;
  plain.wispiness = 0;
  wispy.wispiness = .5;
  int differ = 0;
  double same = 0, moved = 0;
  for (int i = 1; i < 200; ++i) {
    const Vec3 p = vec(.013 * i, .55, .029 * i);
    differ += density_at(plain, p) != density_at(wispy, p);
    // The same formula, written out for one point.
    Vec3 q = vec(5 * p[0], 5 * p[1], 5 * p[2]);
    for (const auto& [strength, frequency] : {std::pair{.025, 10.}, {.0125, 19.9}}) {
      const Vec3 s = noise_slope(vec(frequency * q[0], frequency * q[1], frequency * q[2]));
      for (std::size_t k = 0; k < 3; ++k) q[k] += strength * s[k];
    }
    double sum = 0;
    for (const auto& [strength, frequency] : {std::pair{.5, 1.},
                                              {.25, 1.99},
                                              {.125, 1.99 * 1.99},
                                              {.0625, 1.99 * 1.99 * 1.99},
                                              {.03125, 1.99 * 1.99 * 1.99 * 1.99}})
      sum += strength * noise(vec(frequency * q[0], frequency * q[1], frequency * q[2]));
    same = std::max(same, std::abs(density_at(wispy, p) - std::clamp(.45 * 4.5 * sum, 0., 1.)));
    moved = std::max(moved, density_at(wispy, p));
  }
  EXPECT_GT(differ, 50);
  EXPECT_GT(moved, 0);
  // The two differ only in the order of products. The rounding of 1e-16 grows by frequencies of about 1e2 and
  // slopes of up to 8.5.
  EXPECT_LT(same, 1e-12);
}

TEST(Cloud, UsesAsManyNodesAsTheLimitAllows) {
  Cloud cloud;
  const auto wanted = nodes_for(cloud, std::size_t{1} << 30);
  ASSERT_TRUE(wanted);
  EXPECT_EQ(wanted->per_cell, kWantedPerCell);
  EXPECT_EQ(wanted->sides[0], 399);  // 99.5 noise cells along the box, 4 nodes per cell
  const auto fewer = nodes_for(cloud, std::size_t{1} << 24);
  ASSERT_TRUE(fewer);
  EXPECT_LE(fewer->count(), std::size_t{1} << 24);
  EXPECT_GT(fewer->count(), std::size_t{1} << 23);
  EXPECT_GT(fewer->per_cell, kLeastPerCell);
  EXPECT_FALSE(nodes_for(cloud, 1000));
  cloud.frequency = 0;
  const auto flat = nodes_for(cloud, std::size_t{1} << 24);
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->sides, (std::array{2, 65, 2}));
}

}  // namespace
}  // namespace ls::scene::pbrt
