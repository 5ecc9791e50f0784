// pbrt's clouds, and the noise of which they are made.
#include "worker/render/media/cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace ls::render {
namespace {

V3d vec(double x, double y, double z) { return {x, y, z}; }

CloudVolume volume(double density, double wispiness) {
  CloudVolume v;
  v.density = density;
  v.wispiness = wispiness;
  return v;
}

// The first value is that of Perlin's own program (improved noise, 2002), which others often use as a test;
// the gradients that pbrt has changed do not matter at this point. The other values are those of a separate
// program that follows Perlin's with pbrt's 16 gradients.
TEST(CloudNoise, HasKnownValues) {
  EXPECT_NEAR(cloud_noise(vec(3.14, 42, 7)), 0.13691995878400012, 1e-14);
  EXPECT_NEAR(cloud_noise(vec(.5, .5, .5)), -0.125, 1e-14);
  EXPECT_NEAR(cloud_noise(vec(1.25, 2.5, 3.75)), -0.03836345672607422, 1e-14);
  EXPECT_NEAR(cloud_noise(vec(-7.3, 100.6, .2)), 0.19408821373829105, 1e-13);
  EXPECT_NEAR(cloud_noise(vec(255.9, -1.1, 511.35)), 0.18592218705960284, 1e-12);
  EXPECT_NEAR(cloud_noise(vec(12.4, .7, 31.6)), -0.26998342216089716, 1e-13);
}

TEST(CloudNoise, IsZeroAtWholeNumbersAndRepeatsAfter256) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> random(-4, 4);
  for (int i = 0; i < 200; ++i) {
    const V3d p = vec(random(rng), random(rng), random(rng));
    EXPECT_EQ(cloud_noise(vec(std::floor(p[0]), std::floor(p[1]), std::floor(p[2]))), 0);
    for (int k = 0; k < 3; ++k) {
      V3d q = p;
      q[k] += 256;
      // p + 256 is rounded by 2^-45, and grows by the slope.
      EXPECT_NEAR(cloud_noise(q), cloud_noise(p), kMostNoiseSlope * 0x1p-45);
    }
  }
}

TEST(CloudNoise, InvalidPositionsGiveZero) {
  for (const double x : {1e30, -1e300, HUGE_VAL, -HUGE_VAL, std::nan("")}) {
    EXPECT_EQ(cloud_noise(vec(x, 0, 0)), 0) << x;
    EXPECT_TRUE(std::isfinite(cloud_noise_slope(vec(0, x, .5))[1])) << x;
  }
}

TEST(Cloud, IsDenseBelowAndEmptyAtHeightOne) {
  const Cloud cloud{CloudVolume{}};
  for (const double x : {.1, .37, 5.5}) {
    EXPECT_EQ(cloud.value(vec(x, 0, x)), 1);
    EXPECT_EQ(cloud.value(vec(x, -3, x)), 1);
    EXPECT_EQ(cloud.value(vec(x, 1, x)), 0);
  }
  // As in pbrt the formula is not cut off at height 1. Above it the cloud is dense where noise is negative.
  float above = 0;
  for (const double x : {.1, .37, 5.5}) above = std::max(above, cloud.value(vec(x, 7, x)));
  EXPECT_GT(above, 0);
  // With density 0, only the second term of the formula remains: 1 - 2 y, at least 0.
  const Cloud still(volume(0, 1));
  EXPECT_FLOAT_EQ(still.value(vec(.3, .2, .4)), .6f);
  EXPECT_EQ(still.value(vec(.3, .6, .4)), 0);
}

TEST(Cloud, WispinessDisplacesPointsByTheGradientOfNoise) {
  const Cloud plain(volume(1, 0)), wispy(volume(1, .5));
  int differ = 0;
  double same = 0, moved = 0;
  for (int i = 1; i < 200; ++i) {
    const V3d p = vec(.013 * i, .55, .029 * i);
    differ += plain.value(p) != wispy.value(p);
    // The same formula, written out for one point.
    V3d q = vec(5 * p[0], 5 * p[1], 5 * p[2]);
    for (const auto& [strength, frequency] : {std::pair{.025, 10.}, {.0125, 19.9}}) {
      const V3d s = cloud_noise_slope(vec(frequency * q[0], frequency * q[1], frequency * q[2]));
      q = q + s * strength;
    }
    double sum = 0;
    for (const auto& [strength, frequency] : {std::pair{.5, 1.},
                                              {.25, 1.99},
                                              {.125, 1.99 * 1.99},
                                              {.0625, 1.99 * 1.99 * 1.99},
                                              {.03125, 1.99 * 1.99 * 1.99 * 1.99}})
      sum += strength * cloud_noise(vec(frequency * q[0], frequency * q[1], frequency * q[2]));
    same = std::max(same, std::abs(wispy.value(p) - std::clamp(.45 * 4.5 * sum, 0., 1.)));
    moved = std::max(moved, double{wispy.value(p)});
  }
  EXPECT_GT(differ, 50);
  EXPECT_GT(moved, 0);
  // The two differ in the order of products, whose rounding stays below that of the value to float32.
  EXPECT_LT(same, 0x1p-24);
}

// A million points in boxes of all sizes, of clouds of all kinds
TEST(Cloud, BoundsHoldInBoxes) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> unit(0, 1);
  float tightest = 0, widest = 0;
  for (int i = 0; i < 10000; ++i) {
    CloudVolume v = volume(3 * unit(rng) - .5, i % 4 == 0 ? 0 : 1.5 * unit(rng));
    v.frequency = 20 * unit(rng) - 5;
    const Cloud cloud(v);
    V3d lo, hi;
    for (int k = 0; k < 3; ++k) {
      lo[k] = 3 * unit(rng) - 1;
      hi[k] = lo[k] + std::exp2(-12 * unit(rng));
    }
    const ValueBounds bounds = cloud.bounds(lo, hi);
    for (int j = 0; j < 100; ++j) {
      V3d p;
      for (int k = 0; k < 3; ++k) p[k] = lo[k] + unit(rng) * (hi[k] - lo[k]);
      const float value = cloud.value(p);
      ASSERT_GE(value, bounds.lo);
      ASSERT_LE(value, bounds.hi);
      widest = std::max(widest, value);
    }
    tightest = std::max(tightest, bounds.hi - bounds.lo < .1f && bounds.hi < 1 ? bounds.hi : 0);
  }
  EXPECT_GT(tightest, 0);
  EXPECT_EQ(widest, 1);
}

}  // namespace
}  // namespace ls::render
