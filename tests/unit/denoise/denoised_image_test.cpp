// Compares the estimated error of denoised images with their true error; the noise is synthetic, so the true
// error can be computed. Also tests the denoised image of a film.
#include "util/denoise/denoised_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "worker/fake/fake_pixels.h"

namespace ls {
namespace {

constexpr int kSide = 48;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

using Denoise = std::function<std::vector<float>(const std::vector<float>&)>;

// Returns the image without noise: waves with an edge.
std::vector<float> truth() {
  std::vector<float> out;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c)
        out.push_back(
            static_cast<float>((x > kSide / 2 ? 1.5 : .5) + .3 * std::sin(.4 * x + c) * std::cos(.3 * y)));
  return out;
}

std::vector<float> blurred(const std::vector<float>& from) {
  std::vector<float> out(from.size());
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        int count = 0;
        for (int v = std::max(0, y - 2); v <= std::min(kSide - 1, y + 2); ++v)
          for (int u = std::max(0, x - 2); u <= std::min(kSide - 1, x + 2); ++u)
            sum += from[static_cast<std::size_t>(3 * (v * kSide + u) + c)], ++count;
        out[static_cast<std::size_t>(3 * (y * kSide + x) + c)] = static_cast<float>(.9 * sum / count);
      }
  return out;
}

// Returns one half of the samples: `right` with skewed noise (gamma distributed). Its standard deviation is
// about a third of the value. It is the same in all channels, because channels share paths.
std::vector<float> noisy(const std::vector<float>& right, std::mt19937_64& random) {
  std::gamma_distribution<double> gamma(8, 1. / 8);
  std::vector<float> out(right.size());
  for (std::size_t p = 0; p < kPixels; ++p) {
    const double e = gamma(random);
    for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) out[i] = static_cast<float>(right[i] * e);
  }
  return out;
}

struct Trial {
  DenoisedError estimate;
  // True errors of the denoised image; relmse is relative to the denoised image, like the estimate.
  double mse = 0, relmse = 0;
};
Trial trial(const Denoise& denoise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const std::vector<float> right = truth();
  DenoisedHalves h{noisy(right, random), noisy(right, random), {}, {}, std::vector<bool>(kPixels, true)};
  h.denoised_a = denoise(h.a);
  h.denoised_b = denoise(h.b);
  Trial out{denoised_error(h)};
  for (std::size_t i = 0; i < right.size(); ++i) {
    const double mean = (double{h.denoised_a[i]} + h.denoised_b[i]) / 2, e = mean - right[i];
    out.mse += e * e / static_cast<double>(right.size());
    out.relmse += e * e / (mean * mean + .01) / static_cast<double>(right.size());
  }
  return out;
}

const Denoise kDenoisers[] = {
    blurred,                                              // biased, with little noise
    [](const std::vector<float>& half) { return half; },  // does nothing
    [](const std::vector<float>& half) { return std::vector<float>(half.size(), .8f); },  // ignores the image
};

// Checks that the mean over trials of (estimated - true error) is 0, within five standard errors of this
// mean. By chance, each of the four means that are checked exceeds this once in 1.7 million times.
void expect_right_on_average(const Denoise& denoise, double DenoisedError::*estimate, double Trial::*is) {
  constexpr int kTrials = 500;
  double sum = 0, squares = 0, size = 0;
  for (int t = 0; t < kTrials; ++t) {
    const Trial result = trial(denoise, static_cast<std::uint64_t>(t));
    const double over = result.estimate.*estimate - result.*is;
    sum += over;
    squares += over * over;
    size += result.*is / kTrials;
  }
  const double mean = sum / kTrials, error = std::sqrt((squares / kTrials - mean * mean) / kTrials);
  EXPECT_NEAR(mean, 0, 5 * error) << "of " << size;
  EXPECT_LT(5 * error, .05 * size) << "too few trials to tell";
}

TEST(DenoisedError, IsUnbiasedForEveryDenoiser) {
  for (const Denoise& denoise : kDenoisers) {
    expect_right_on_average(denoise, &DenoisedError::mse, &Trial::mse);
  }
  // The relative error is exact only if its weight does not depend on the pixel's own noise. With the blur it
  // does, slightly, so only the constant image is checked.
  expect_right_on_average(kDenoisers[2], &DenoisedError::relmse, &Trial::relmse);
}

// A correct 95 % interval covers the true error in 463 or more of 500 trials with a probability of 0.995: the
// number of covered trials is binomial with mean 475 and standard deviation 4.87. Intervals that are too wide
// also pass.
TEST(DenoisedError, IntervalCoversTheTrueError) {
  constexpr int kTrials = 500;
  for (const Denoise& denoise : kDenoisers) {
    int covered = 0;
    for (int t = 0; t < kTrials; ++t) {
      const Trial result = trial(denoise, 1000 + static_cast<std::uint64_t>(t));
      const double rmse = std::sqrt(result.mse);
      covered += result.estimate.rmse_lo <= rmse && rmse <= result.estimate.rmse_hi;
    }
    EXPECT_GE(covered, 463);
  }
}

// One pixel, a lamp, is much brighter than all others, and the denoiser leaves it unchanged. The two halves
// of a single pixel do not give the variance of its noise.
TEST(DenoisedError, HasNoIntervalWhereAFewPixelsCarryIt) {
  std::mt19937_64 random(3);
  const std::vector<float> right = truth();
  DenoisedHalves h{noisy(right, random), noisy(right, random), {}, {}, std::vector<bool>(kPixels, true)};
  h.denoised_a = blurred(h.a);
  h.denoised_b = blurred(h.b);
  EXPECT_TRUE(denoised_error(h).rmse_interval && denoised_error(h).relmse_interval);

  for (std::size_t c = 0; c < 3; ++c) h.a[c] = h.denoised_a[c] = 1e4F, h.b[c] = h.denoised_b[c] = 2e4F;
  EXPECT_FALSE(denoised_error(h).rmse_interval);
  EXPECT_TRUE(denoised_error(h).relmse_interval) << "of all pixels, relatively, it is one";
}

TEST(DenoisedError, LeavesOutPixelsWithoutSamples) {
  DenoisedHalves h{
      {1, 1, 1, 0, 0, 0}, {3, 3, 3, 0, 0, 0}, {2, 2, 2, 9, 9, 9}, {2, 2, 2, 9, 9, 9}, {true, false}};
  EXPECT_DOUBLE_EQ(denoised_error(h).mse, -1);  // (1 - 2) (3 - 2) + 0: noise can make the estimate negative
  EXPECT_EQ(denoised_error(h).rmse, 0);
  h.counts = {false, false};
  EXPECT_EQ(denoised_error(h).rmse_hi, 0);
}

// The film has three tiles, the last without samples. A fake library blurs over 3 x 3 pixels.
TEST(DenoisedImage, IsTheMeanOfTheDenoisedHalvesOfAFilm) {
  const auto denoiser = Denoiser::find(1, (program_beside_us("../fake_oidn") / "blurs.so").string());
  ASSERT_TRUE(denoiser) << denoiser.error().message;
  const AovSet aovs = aovs_of(AovKind::guide);
  const TileGrid grid{{24, 8}, 8};
  Film film(grid, aovs);
  for (const TileIndex t : {0u, 1u})
    ASSERT_TRUE(film.fold(t, 0, fake_partial({{}, {}, {}, grid.rect(t), {0, 2}}, aovs)));

  const auto image = denoised_image(film, *denoiser);

  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->by, "Open Image Denoise 2.99.7");
  ASSERT_EQ(image->rgb.size(), 3u * 24 * 8);
  // The green value of pixel (3, 3) of the first tile. In a fake partial each plane of a guide is the red sum
  // over both samples; half A has one of the two samples, so its mean is twice as large as that of the image.
  const TilePixels pixels = film.pixels(0);
  double sum = 0;
  for (std::size_t y = 2; y <= 4; ++y)
    for (std::size_t x = 2; x <= 4; ++x) sum += pixels.mean[3 * (8 * y + x) + 1];
  const double red = 2 * pixels.mean[3 * (8 * 3 + 3)], guides = (red + red) / 2;
  EXPECT_NEAR(image->rgb[3 * (24 * 3 + 3) + 1], sum / 9 + guides / 16, 1e-5);
  for (std::size_t y = 0; y < 8; ++y) EXPECT_EQ(image->rgb[3 * (24 * y + 20)], 0) << "no samples, no light";
}

}  // namespace
}  // namespace ls
