// Skewed noise: a bright outlier raises both a pixel's value and the difference of its halves. Tests the
// correction that is computed from the samples of the last round.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "core/image/error/error_estimate.h"
#include "core/image/film/film.h"

namespace ls {
namespace {

constexpr int kSkewedSide = 32;
constexpr std::size_t kNoisyPixels = kSkewedSide * kSkewedSide;
constexpr double kSkewedDark = 0.01;

using Halves = std::array<std::vector<double>, 2>;

// The image has stripes, a structure larger than its noise, so that each pixel is weighted by its own value
// (g near 1 in error_estimate.h). The noise of a sample is exponential with standard deviation kNoise.
constexpr double kNoise = .35;
double truth(std::size_t p) { return p % 2 ? .5 : .9; }

// Returns the sums of `samples` samples for each half of every pixel; the three channels are equal.
Halves skewed(double samples, std::mt19937_64& random) {
  Halves out;
  for (auto& half : out) {
    half.resize(3 * kNoisyPixels);
    for (std::size_t p = 0; p < kNoisyPixels; ++p) {
      const double v = samples * (truth(p) - kNoise) + std::gamma_distribution(samples, kNoise)(random);
      for (std::size_t c = 0; c < 3; ++c) half[c * kNoisyPixels + p] = v;
    }
  }
  return out;
}

struct Sums {
  double plain = 0, corrected = 0, realised = 0;
};

// Estimates the error after 64 samples, 32 of which are in the last round.
Sums trial(std::mt19937_64& random) {
  Halves before = skewed(16, random), now = skewed(16, random);
  Sums out;
  for (std::size_t h = 0; h < 2; ++h)
    for (std::size_t i = 0; i < 3 * kNoisyPixels; ++i) {
      now[h][i] = (now[h][i] + before[h][i]) / 32;
      before[h][i] /= 16;
    }
  const HalfMeans halves{kSkewedSide, kSkewedSide, now[0], now[1]};
  const EarlierMeans earlier{{kSkewedSide, kSkewedSide, before[0], before[1]}, 32};
  out.plain = estimate_error(halves, 64).relative.squares;
  const TileError told = estimate_error(halves, 64, &earlier);
  EXPECT_DOUBLE_EQ(told.relative.squares + told.skew, out.plain);
  out.corrected = told.relative.squares;
  for (std::size_t i = 0; i < 3 * kNoisyPixels; ++i) {
    const double right = truth(i % kNoisyPixels), e = (now[0][i] + now[1][i]) / 2 - right;
    out.realised += e * e / (right * right + kSkewedDark);
  }
  return out;
}

// A sample has the variance s^2 and the third cumulant 2 s^3, with s = kNoise. So with N samples the variance
// is v = s^2 / N, cov(D^2, S) = 2 s^3 / N^2, and the relative error of the uncorrected sum is f'/f cov / v =
// -4 m s / (m^2 + c) / N. At N = 64 that is -4.2 % at m = .5 and -2.4 % at .9; the weighted mean is -3.8 %,
// of which g leaves nearly all. The mean ratio of 400 trials of 1,024 pixels has the standard error 2 /
// sqrt(400 * 1024) = .3 %. The additional .5 % is for terms of second order in the noise, a few times the
// square of 4 %.
TEST(SkewedNoise, LastRoundCorrectsTheRelativeErrorForSkew) {
  std::mt19937_64 random(11);
  Sums sum;
  for (int i = 0; i < 400; ++i) {
    const Sums t = trial(random);
    sum.plain += t.plain, sum.corrected += t.corrected, sum.realised += t.realised;
  }

  EXPECT_LT(sum.plain / sum.realised, .975) << "or there is nothing to correct";
  EXPECT_NEAR(sum.corrected / sum.realised, 1, .005 + 4 * .003);
}

TEST(SkewedNoise, DarkPixelsNeedNoCorrection) {
  std::vector<double> a(3 * kNoisyPixels), b = a, a0 = a, b0 = a;
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal(0, 1e-3);
  for (auto* half : {&a, &b, &a0, &b0})
    for (double& v : *half) v = normal(random);
  const EarlierMeans earlier{{kSkewedSide, kSkewedSide, a0, b0}, 32};
  const TileError told = estimate_error({kSkewedSide, kSkewedSide, a, b}, 64, &earlier);
  EXPECT_LT(std::abs(told.skew), 1e-3 * told.relative.squares);
}

// With few samples, more is unknown of the weights than the first order of the noise tells.
TEST(SkewedNoise, IntervalOfFewSamplesIsWiderThanTheIntervalsOfBothWeightings) {
  std::mt19937_64 random(13);
  Halves before = skewed(2, random), now = skewed(2, random);
  for (std::size_t h = 0; h < 2; ++h)
    for (std::size_t k = 0; k < 3 * kNoisyPixels; ++k) {
      now[h][k] = (now[h][k] + before[h][k]) / 4;
      before[h][k] /= 2;
    }
  const EarlierMeans earlier{{kSkewedSide, kSkewedSide, before[0], before[1]}, 4};
  const TileError told = estimate_error({kSkewedSide, kSkewedSide, now[0], now[1]}, 8, &earlier);
  TileError alone = told;
  alone.other_weights = alone.unsure_weights = 0;
  for (const double other : {.3, -.3}) {
    TileError both = alone;
    both.other_weights = other * both.relative.squares;
    const ImageError image = image_error(both), without = image_error(alone);
    EXPECT_DOUBLE_EQ(image.relmse, without.relmse);
    const double factor = 1 + other, beyond = std::sqrt(factor);
    EXPECT_DOUBLE_EQ(image.relmse_lo, without.relmse_lo * (other < 0 ? factor : 1 / beyond));
    EXPECT_DOUBLE_EQ(image.relmse_hi, without.relmse_hi * (other > 0 ? factor : 1 / beyond));
  }
  EXPECT_NE(told.other_weights, 0);
  EXPECT_EQ(estimate_error({kSkewedSide, kSkewedSide, now[0], now[1]}, 8).other_weights, 0);
}

// A tenth of each value's variance is common to all pixels of a square of 16 x 16.
TEST(CorrelatedNoise, IsCountedWithinSquares) {
  std::mt19937_64 random(14);
  std::normal_distribution<double> normal(0, 1e-3);
  constexpr double kCorrelation = .1;
  double squares = 0, pixels = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const auto draw = [&] {
      std::vector<double> out(3 * kNoisyPixels);
      std::array<double, 4> common;
      for (double& v : common) v = normal(random);
      for (std::size_t p = 0; p < kNoisyPixels; ++p) {
        const std::size_t square = p / (16 * kSkewedSide) * 2 + p % kSkewedSide / 16;
        const double v =
            std::sqrt(kCorrelation) * common[square] + std::sqrt(1 - kCorrelation) * normal(random);
        for (std::size_t c = 0; c < 3; ++c) out[c * kNoisyPixels + p] = v;
      }
      return out;
    };
    const auto a0 = draw(), b0 = draw(), a = draw(), b = draw();
    const EarlierMeans earlier{{kSkewedSide, kSkewedSide, a0, b0}, 32};
    const TileError told = estimate_error({kSkewedSide, kSkewedSide, a, b}, 64, &earlier);
    squares += told.plain.changes.square_products;
    pixels += told.plain.changes.products;
  }
  // Each pixel has 255 others in its square. 1,600 squares tell the ratio to sqrt(2 / 1600) = 3.5 %, doubled
  // for products of normal values with a common part.
  const double right = 1 + 255 * kCorrelation * kCorrelation;
  EXPECT_NEAR(squares / pixels, right, 5 * .07 * right);
  EXPECT_GT(squares / pixels, 1.05) << "or the common part is not seen";
}

Partial partial_of(const TileGrid& grid, const SampleRange& range, std::uint64_t seed) {
  Partial p;
  p.header.tile = grid.rect(0);
  p.header.samples = range;
  std::mt19937_64 random(seed);
  const double half = static_cast<double>(range.count()) / 2;
  const auto pixels = static_cast<std::size_t>(grid.rect(0).pixels());
  for (std::size_t plane = 0; plane < kPartialChannels; ++plane)
    for (std::size_t i = 0; i < pixels; ++i)
      p.sums.push_back(static_cast<float>(std::gamma_distribution(half, truth(i))(random)));
  return p;
}

TEST(SkewedNoise, FilmKeepsTheCorrectionOverARestart) {
  const TileGrid grid{{kSkewedSide, kSkewedSide}, kSkewedSide};
  Film film(grid);
  for (const RoundIndex k : {0, 1, 2, 3}) ASSERT_TRUE(film.fold(0, k, partial_of(grid, round_range(k), k)));
  ASSERT_NE(film.error(0).skew, 0);
  ASSERT_NE(film.error(0).other_weights, 0) << "the last round has as many samples as all before it";

  Film one(grid);
  ASSERT_TRUE(one.load_tile(0, film.save_tile(0)));
  EXPECT_EQ(one.error(0), film.error(0));
}

// The error after round k must not depend on whether a truncated round k was folded before.
TEST(SkewedNoise, ReplacedTailLeavesNoTrace) {
  const TileGrid grid{{kSkewedSide, kSkewedSide}, kSkewedSide};
  Film once(grid), twice(grid);
  for (const RoundIndex k : {0, 1, 2})
    for (Film* film : {&once, &twice}) ASSERT_TRUE(film->fold(0, k, partial_of(grid, round_range(k), k)));
  const SampleRange cut{8, 12};
  const auto tail = twice.fold(0, 3, partial_of(grid, cut, 3));
  ASSERT_TRUE(tail);
  EXPECT_NE(tail->skew, 0);
  for (Film* film : {&once, &twice}) ASSERT_TRUE(film->fold(0, 3, partial_of(grid, round_range(3), 4)));

  EXPECT_EQ(once.error(0), twice.error(0));
  EXPECT_TRUE(once == twice);
}

}  // namespace
}  // namespace ls
