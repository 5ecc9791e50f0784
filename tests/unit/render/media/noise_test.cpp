// Gradient noise, its octaves, and bounds of them.
#include "worker/render/media/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace ls::render {
namespace {

V3d random_point(std::mt19937_64& rng, double reach) {
  std::uniform_real_distribution<double> along(-reach, reach);
  V3d p;
  for (int k = 0; k < 3; ++k) p[k] = along(rng);
  return p;
}

// Proves the bound of noise() that its header states. The magnitude of noise is at most the mean, with
// Perlin's weights, of the largest |g . d| at each corner, which is the sum of the two largest |d_k|. The
// mean of these sums changes along an axis by at most 1 + 2 w' <= 1 + 2 * 15/8 (two means, each at most 2,
// change places with the weight w), so between points of a lattice of width h it exceeds their largest by at
// most 3 h / 2 times that. By symmetry an eighth of the cell is enough.
TEST(Noise, IsWithinItsBound) {
  constexpr int kSteps = 160;
  constexpr double h = .5 / kSteps, kSlope = 1 + 2 * 15. / 8;
  double most = 0;
  for (int k = 0; k <= kSteps; ++k)
    for (int j = 0; j <= k; ++j)
      for (int i = 0; i <= j; ++i) {
        const double p[3] = {i * h, j * h, k * h};
        double sum = 0;
        for (int c = 0; c < 8; ++c) {
          double weight = 1, all = 0, least = 1;
          for (int a = 0; a < 3; ++a) {
            const bool far = (c >> a & 1) != 0;
            const double w = perlin_weight(p[a]), d = far ? 1 - p[a] : p[a];
            weight *= far ? w : 1 - w;
            all += d;
            least = std::min(least, d);
          }
          sum += weight * (all - least);
        }
        most = std::max(most, sum);
      }
  EXPECT_LT(most + 3 * h / 2 * kSlope, kMostNoise);
  EXPECT_GT(most, 1.03);  // the bound is not a mile off
}

TEST(Noise, SlopeAndBendAreWithinTheirBounds) {
  double slope = 0, bend = 0;
  for (int i = 0; i <= 10000; ++i) {
    const double x = i / 10000., w1 = 30 * x * x * (1 - x) * (1 - x), w2 = 60 * x * (1 - x) * (1 - 2 * x);
    slope = std::max(slope, 3 * w1 + 1);
    bend = std::max(bend, 3 * std::abs(w2) + 4 * w1);
  }
  // Between the steps both change by less than 1e-6 of themselves.
  EXPECT_LE(slope, kMostNoiseSlope);
  EXPECT_LT(bend * (1 + 1e-6), kMostNoiseBend);
}

TEST(Noise, IsZeroAtWholeNumbersAndWhereThereAreNoParts) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < 1000; ++i) {
    const V3d p = random_point(rng, 1e6);
    EXPECT_EQ(gradient_noise(5, {std::floor(p.x), std::floor(p.y), std::floor(p.z)}), 0);
  }
  for (const double x : {1e30, -1e300, HUGE_VAL, -HUGE_VAL, std::nan("")})
    EXPECT_EQ(gradient_noise(5, {.3, x, .3}), 0);
}

TEST(Noise, IsSmoothAcrossCells) {
  std::mt19937_64 rng(2);
  // Three coordinates are rounded by 2^-25, times the slope, and some 20 sums of numbers up to 2 by 2^-24.
  constexpr double kStep = 1e-3, kRounding = 2e-6;
  for (int i = 0; i < 20000; ++i) {
    V3d p = random_point(rng, 100);
    p[i % 3] = std::round(p[i % 3]);  // on a face between cells
    for (int k = 0; k < 3; ++k) {
      V3d a = p, b = p;
      a[k] -= kStep;
      b[k] += kStep;
      const double before = gradient_noise(9, p) - gradient_noise(9, a),
                   after = gradient_noise(9, b) - gradient_noise(9, p);
      EXPECT_LE(std::abs(before), kMostNoiseSlope * kStep + 2 * kRounding);
      // The slope changes by at most a step's bend.
      EXPECT_LE(std::abs(after - before), kMostNoiseBend * kStep * kStep + 4 * kRounding);
    }
  }
}

// The noise is the same on every machine: only integers, sums and products are used.
TEST(Noise, HasTheseBits) {
  EXPECT_EQ(std::bit_cast<std::uint32_t>(gradient_noise(1, {.3, .7, -.2})), 1041937102u);
  NoiseVolume v;
  v.octaves = 7;
  v.seed = 12;
  EXPECT_EQ(std::bit_cast<std::uint32_t>(FractalNoise(v).value({10.3, -4.7, 2.2})), 3183301854u);
}

TEST(Noise, DiffersByItsSeedAndByItsOctave) {
  std::mt19937_64 rng(3);
  NoiseVolume v;
  v.octaves = 1;
  const FractalNoise one(v);
  v.seed = 1;
  const FractalNoise other(v);
  v.octaves = 2;
  v.lacunarity = 1;
  const FractalNoise twice(v);
  double product = 0, squares = 0, repeated = 0;
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    const V3d p = random_point(rng, 1000);
    const double a = one.value(p), b = other.value(p), c = 1.5 * twice.value(p) - b;
    product += a * b;
    repeated += b * c;
    squares += a * a;
  }
  // Correlations of independent noises: 5 / sqrt(n)
  EXPECT_LT(std::abs(product / squares), 5 / std::sqrt(kPoints));
  EXPECT_LT(std::abs(repeated / squares), 5 / std::sqrt(kPoints));
  EXPECT_GT(squares / kPoints, .02);
}

TEST(FractalNoise, StaysWithinOneAndLeavesOutOctavesWithoutStrength) {
  std::mt19937_64 rng(4);
  NoiseVolume v;
  v.octaves = 16;
  v.gain = 0;
  const FractalNoise one(v);
  v.octaves = 1;
  const FractalNoise first(v);
  v.octaves = 16;
  v.gain = 1;
  v.lacunarity = 8;
  const FractalNoise all(v);
  for (int i = 0; i < 1000; ++i) {
    const V3d p = random_point(rng, 1e6);
    EXPECT_EQ(one.value(p), first.value(p));
    EXPECT_LE(std::abs(all.value(p)), 1);
  }
}

// A million points in boxes of all sizes
TEST(FractalNoise, BoundsHoldInBoxes) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> unit(0, 1);
  double tightest = 0;
  int boxes = 0;
  for (int i = 0; i < 5000; ++i) {
    NoiseVolume v;
    v.octaves = 1 + i % 16;
    v.gain = unit(rng);
    v.lacunarity = 1 + 3 * unit(rng);
    v.seed = static_cast<std::uint64_t>(i);
    const FractalNoise noise(v);
    V3d lo = random_point(rng, 50), hi;
    for (int k = 0; k < 3; ++k) hi[k] = lo[k] + std::exp2(-8 * unit(rng)) / 3;
    const ValueBounds bounds = noise.bounds(lo, hi);
    float least = 2, most = -2;
    for (int j = 0; j < 200; ++j) {
      V3d p;
      for (int k = 0; k < 3; ++k) p[k] = lo[k] + unit(rng) * (hi[k] - lo[k]);
      const float value = noise.value(p);
      ASSERT_GE(value, bounds.lo);
      ASSERT_LE(value, bounds.hi);
      least = std::min(least, value);
      most = std::max(most, value);
    }
    tightest = std::max(tightest, double{most - least} / (bounds.hi - bounds.lo));
    ++boxes;
  }
  EXPECT_GT(tightest, .5);  // some bounds are close to what is there
  EXPECT_EQ(boxes, 5000);
}

}  // namespace
}  // namespace ls::render
