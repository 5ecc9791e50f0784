// Synthetic images with known noise. Seeds are fixed. The derivation of each threshold is beside it.
#include "core/image/error/area_error.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "core/image/error/error_estimate.h"

namespace ls {
namespace {

constexpr int kAreaSide = 128;
constexpr std::size_t kAreaPixels = kAreaSide * kAreaSide;
using AreaHalves = std::array<std::vector<double>, 2>;

// Draws the half means of the samples of one round of a grey image of value 1. Each half mean of each pixel
// has three parts of noise, with the standard deviations `pixel`, `square` (in common with its square of
// 16 x 16 pixels) and `image` (in common with all pixels).
AreaHalves noisy_halves(double pixel, double square, double image, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  AreaHalves halves;
  for (auto& half : halves) {
    half.resize(3 * kAreaPixels);
    const double of_image = image * normal(random);
    std::vector<double> of_squares(kAreaPixels / 256);
    for (double& s : of_squares) s = square * normal(random);
    for (std::size_t i = 0; i < kAreaPixels; ++i) {
      const std::size_t y = i / kAreaSide, x = i % kAreaSide;
      const double value = 1 + of_image + of_squares[y / 16 * 8 + x / 16] + pixel * normal(random);
      for (std::size_t c = 0; c < 3; ++c) half[c * kAreaPixels + i] = value;
    }
  }
  return halves;
}

struct AreaCoverage {
  double mean = 0, squares = 0;  // shares of images whose interval holds
};

// Measures these shares with images of two rounds of equally many samples.
AreaCoverage held_areas(int images, double pixel, double square, double image, bool common) {
  std::mt19937_64 random(21);
  AreaCoverage out;
  for (int n = 0; n < images; ++n) {
    const AreaHalves before = noisy_halves(pixel, square, image, random),
                     last = noisy_halves(pixel, square, image, random);
    AreaHalves now = before;
    for (std::size_t h = 0; h < 2; ++h)
      for (std::size_t i = 0; i < now[h].size(); ++i) now[h][i] = (before[h][i] + last[h][i]) / 2;
    const EarlierMeans earlier{{kAreaSide, kAreaSide, before[0], before[1]}, 32};
    const AreaError e = area_error(area_sums({kAreaSide, kAreaSide, now[0], now[1]}, 64, &earlier), common);
    double sum = 0, relmse = 0;
    std::vector<double> errors(kAreaPixels / 256);
    for (std::size_t i = 0; i < kAreaPixels; ++i) {
      const double error = (now[0][i] + now[1][i]) / 2 - 1;
      sum += error / kAreaPixels;
      errors[i / kAreaSide / 16 * 8 + i % kAreaSide / 16] += error / 256;
    }
    for (const double error : errors) relmse += error * error / 1.01 / static_cast<double>(errors.size());
    EXPECT_NEAR(e.mean[1], 1 + sum, 1e-12);
    out.mean += (std::abs(sum) <= e.half_width[1]) / double(images);
    out.squares += (e.relmse_lo <= relmse && relmse <= e.relmse_hi) / double(images);
  }
  return out;
}

// A share of 400 images that is expected to be 0.95 has the standard deviation 0.011: 0.9 and 0.995 are more
// than four away.
TEST(AreaError, IntervalsHoldForIndependentPixelsAndForSquaresWithSharedErrors) {
  for (const double square : {0., .02}) {
    const AreaCoverage held = held_areas(400, .1, square, 0, false);
    EXPECT_GT(held.mean, .9) << square;
    EXPECT_LT(held.mean, .995) << square;
    EXPECT_GT(held.squares, .9) << square;
  }
}

// 16 squares, of which one has most of the noise: 20 x 20 pixels get their light from 3 of 100 samples. The
// sums over squares alone hold for 92.4 % of such images. A share of 4,000 that is expected to be 0.95 has
// the standard deviation .0034: .938 is 3.5 away.
TEST(AreaError, IntervalOfTheMeanHoldsForSmallImagesWithRareLight) {
  constexpr int kSide = 64;
  constexpr std::size_t kPixels = kSide * kSide, kLit = 20;
  std::mt19937_64 random(24);
  std::bernoulli_distribution found(.03);
  int held = 0;
  for (int n = 0; n < 4000; ++n) {
    std::array<std::vector<double>, 2> halves;
    double error = 0;
    for (auto& half : halves) {
      half.assign(3 * kPixels, 1);
      for (std::size_t i = 0; i < kLit * kLit; ++i) {
        const double value = found(random) ? 1 / .03 : 0;
        for (std::size_t c = 0; c < 3; ++c) half[c * kPixels + i / kLit * kSide + i % kLit] = value;
        error += (value - 1) / 2 / static_cast<double>(kPixels);
      }
    }
    const AreaError e = area_error(area_sums({kSide, kSide, halves[0], halves[1]}, 2, nullptr), false);
    held += std::abs(error) <= e.half_width[1];
  }
  EXPECT_GT(held, 4000 * .938);
}

TEST(AreaError, IntervalOfTheMeanHoldsForKnownSharedErrors) {
  const AreaCoverage held = held_areas(400, .1, 0, .01, true);
  EXPECT_GT(held.mean, .9);
  EXPECT_LT(held.mean, .995);
  // The error of the mean is .005, of which pixels alone explain .1 / 256 = .0004.
  EXPECT_LT(held_areas(50, .1, 0, .01, false).mean, .5);
}

// With 1,024 samples the last round has 64: its part is far smaller than that of the samples before it.
TEST(AreaError, IntervalOfTheMeanHoldsForSharedErrorsEvenIfTheLastRoundIsSmall) {
  std::mt19937_64 random(23);
  std::normal_distribution<double> normal;
  constexpr std::uint64_t kSamples = 1024, kLast = 64, kBefore = kSamples - kLast;
  constexpr std::size_t kValues = std::size_t{3} * 32 * 32;
  int held = 0;
  for (int n = 0; n < 2000; ++n) {
    std::array<std::vector<double>, 2> before, now;
    double error = 0;
    for (std::size_t h = 0; h < 2; ++h) {
      const double first = normal(random) / std::sqrt(double{kBefore}),
                   last = normal(random) / std::sqrt(double{kLast}),
                   all = (first * kBefore + last * kLast) / kSamples;
      before[h].assign(kValues, 1 + first);
      now[h].assign(kValues, 1 + all);
      error += all / 2;
    }
    const EarlierMeans earlier{{32, 32, before[0], before[1]}, kBefore};
    const AreaError e = area_error(area_sums({32, 32, now[0], now[1]}, kSamples, &earlier), true);
    held += std::abs(error) <= e.half_width[0];
  }
  EXPECT_GT(held, 2000 * .93);  // .95 of 2,000 has the standard deviation .005
}

TEST(AreaError, SumsOfTilesAreThoseOfTheImage) {
  std::mt19937_64 random(22);
  const AreaHalves whole = noisy_halves(.1, .02, 0, random);
  const AreaSums expected = area_sums({kAreaSide, kAreaSide, whole[0], whole[1]}, 8, nullptr);
  AreaSums sum;
  for (int ty = 0; ty < 4; ++ty)
    for (int tx = 0; tx < 4; ++tx) {
      AreaHalves tile;
      for (std::size_t h = 0; h < 2; ++h)
        for (std::size_t c = 0; c < 3; ++c)
          for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x)
              tile[h].push_back(whole[h][(c * kAreaSide + static_cast<std::size_t>(ty * 32 + y)) * kAreaSide +
                                         static_cast<std::size_t>(tx * 32 + x)]);
      sum.add(area_sums({32, 32, tile[0], tile[1]}, 8, nullptr));
    }
  EXPECT_EQ(sum.count, expected.count);
  EXPECT_EQ(sum.pixels, expected.pixels);
  const AreaError a = area_error(sum, false), b = area_error(expected, false);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(a.mean[c], b.mean[c], 1e-12);
    EXPECT_NEAR(a.half_width[c], b.half_width[c], 1e-12);
  }
  EXPECT_NEAR(a.relmse, b.relmse, 1e-15);
  EXPECT_NEAR(a.relmse_hi, b.relmse_hi, 1e-12);
}

TEST(AreaError, WorksOnTilesOfAnyShapeAndWithoutPixels) {
  EXPECT_EQ(area_error(AreaSums{}, true).relmse, 0);
  for (const auto& [w, h] : {std::pair{1, 1}, {17, 1}, {1, 33}, {31, 19}}) {
    const auto n = static_cast<std::size_t>(w * h);
    std::vector<double> a(3 * n, .5), b(3 * n, .3);
    const AreaSums sums = area_sums({w, h, a, b}, 64, nullptr);
    const AreaError e = area_error(sums, false);
    EXPECT_EQ(sums.count, static_cast<std::size_t>((w + 15) / 16 * ((h + 15) / 16)));
    EXPECT_NEAR(e.mean[0], .4, 1e-12);
    EXPECT_NEAR(e.relmse, .01 / (.16 + .01), 1e-12) << "every square's error is 0.1";
    EXPECT_GE(e.half_width[0], .1) << w << " x " << h;
    EXPECT_EQ(e.relmse_hi, 0) << "too few squares";
  }
}

}  // namespace
}  // namespace ls
