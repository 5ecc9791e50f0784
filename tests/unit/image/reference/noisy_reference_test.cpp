// The true error against a noisy reference: the noise of the reference that remains in it, and the
// conclusions drawn from it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/image/error/convergence.h"
#include "core/image/error/error_estimate.h"
#include "core/image/reference/reference.h"
#include "tests/support/significance.h"

namespace ls {
namespace {

constexpr int kWidth = 32;
constexpr std::size_t kPixels = std::size_t{kWidth} * kWidth, kValues = 3 * kPixels;

double brightness(std::size_t pixel) { return .5 + static_cast<double>(pixel % kWidth) / kWidth; }

// Simulates an image: grey Gaussian noise, per sample `spread` times the pixel's brightness, and `bias`,
// which does not fall with samples.
class Render {
 public:
  Render(std::uint64_t seed, double spread, double bias = 0) : spread_(spread), bias_(bias), random_(seed) {}

  void to(std::uint64_t spp) {
    const double more = std::sqrt(static_cast<double>(spp - spp_) / 2);
    for (std::vector<double>* half : {&a_, &b_})
      for (std::size_t p = 0; p < kPixels; ++p)
        (*half)[p] += more * spread_ * brightness(p) * normal_(random_);
    spp_ = spp;
  }
  double mean(const std::vector<double>& half, std::size_t p) const {
    return brightness(p) + bias_ + 2 * half[p] / static_cast<double>(spp_);
  }
  std::vector<float> image() const {
    std::vector<float> out;
    for (std::size_t p = 0; p < kPixels; ++p)
      out.insert(out.end(), 3, static_cast<float>((mean(a_, p) + mean(b_, p)) / 2));
    return out;
  }
  Reference reference() const {
    Reference out{{kWidth, kWidth}, image(), {}};
    for (std::size_t p = 0; p < kPixels; ++p)
      out.error.insert(out.error.end(), 3, static_cast<float>(std::abs(mean(a_, p) - mean(b_, p)) / 2));
    return out;
  }
  ErrorPoint point(const Reference& against) const {
    std::vector<double> a(kValues), b(kValues);
    for (std::size_t i = 0; i < kValues; ++i) a[i] = mean(a_, i % kPixels), b[i] = mean(b_, i % kPixels);
    const ImageError e = image_error(estimate_error({kWidth, kWidth, a, b}, spp_));
    const auto spp = static_cast<double>(spp_);
    const TrueError truth = true_error(against, image());
    return {spp, spp, e.relmse, e.relmse_lo, e.relmse_hi, truth.relmse, truth.relmse_stderr};
  }
  // Returns the error against the noise-free image.
  double relmse() const {
    double sum = 0;
    const std::vector<float> x = image();
    for (std::size_t i = 0; i < kValues; ++i) {
      const double m = brightness(i / 3), d = x[i] - m;
      sum += d * d / (m * m + .01);
    }
    return sum / kValues;
  }

 private:
  double spread_, bias_;
  std::vector<double> a_ = std::vector<double>(kPixels), b_ = a_;
  std::uint64_t spp_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

// Simulates jobs of 256 samples, each with its own reference. Returns the number of jobs for which a bias
// floor is reported.
int floors(int jobs, std::uint64_t reference_spp, double bias) {
  int found = 0;
  for (int i = 0; i < jobs; ++i) {
    const auto seed = 1000 + 2 * static_cast<std::uint64_t>(i);
    Render right(seed, .5), job(seed + 1, .5, bias);
    right.to(reference_spp);
    const Reference reference = right.reference();
    std::vector<ErrorPoint> points;
    for (std::uint64_t spp = 8; spp <= 256; spp *= 2) job.to(spp), points.push_back(job.point(reference));
    found += judge(points, "").kind == ConvergenceStatus::Kind::bias_floor;
  }
  return found;
}

// By chance, a job exceeds four standard errors once in 30,000 times. So two of 200 jobs do once in 50,000
// runs of this test.
TEST(NoisyReference, IsNoBiasFloor) {
  EXPECT_LE(floors(200, 8, 0), 1);
  EXPECT_LE(floors(200, 64, 0), 1);
}

// Averaged over the pixels, the bias of .05 has a relative squared error of .0033; that of the noise is .001
// at 256 samples. With a reference of 64 samples, whose relative variance is .004, the true error has a
// standard error of about 2 sqrt(.004 (.0043 + .004)) / sqrt(1024) = .00036.
TEST(NoisyReference, DoesNotHideAFloor) { EXPECT_EQ(floors(50, 64, .05), 50); }

// The reference has a quarter of the image's samples, so its variance r is four times the squared error of
// the image, and r / m^2 = .0625 / 8 = .0078 for a pixel of value m. One figure has the relative standard
// deviation 2 sqrt(4 + 16) / sqrt(1024) = 28 % (reference.h), the mean of 2000 .6 %. The derivation there
// neglects terms of second order in r: 60 (r / m^2)^2 = .4 %.
TEST(NoisyReference, DoesNotBiasTheRelativeError) {
  constexpr int kTrials = 2000;
  double sum = 0, squares = 0;
  for (int i = 0; i < kTrials; ++i) {
    const auto seed = 9000 + 2 * static_cast<std::uint64_t>(i);
    Render noisy(seed, .25), job(seed + 1, .25);
    noisy.to(8), job.to(32);
    const double ratio = true_error(noisy.reference(), job.image()).relmse / job.relmse();
    sum += ratio, squares += ratio * ratio;
  }
  const double mean = sum / kTrials, sigma = std::sqrt((squares / kTrials - mean * mean) / kTrials);
  EXPECT_NEAR(mean, 1, test::kStandardErrors * sigma + .004);
  // Otherwise the bound above would test nothing.
  EXPECT_LT(sigma, .008);
}

// Compares the standard error that is computed for each reference with the standard deviation of the figures
// over many references. For grey noise the computation is exact. The standard deviation of 2000 figures is
// known to 1 / sqrt(2 * 2000) = 1.6 % (one standard deviation), the mean of the computed standard errors more
// precisely.
TEST(NoisyReference, ReportsTheStandardErrorOfTheRest) {
  constexpr int kTrials = 2000;
  double sum = 0, squares = 0, variance = 0;
  Render job(1, .25);
  job.to(16);
  for (int i = 0; i < kTrials; ++i) {
    Render noisy(9001 + static_cast<std::uint64_t>(i), .25);
    noisy.to(16);
    const TrueError e = true_error(noisy.reference(), job.image());
    sum += e.relmse, squares += e.relmse * e.relmse, variance += *e.relmse_stderr * *e.relmse_stderr;
  }
  const double mean = sum / kTrials, strays = std::sqrt(squares / kTrials - mean * mean);
  EXPECT_NEAR(std::sqrt(variance / kTrials) / strays, 1, 4 * .016);
}

TEST(NoisyReference, EqualErrorLeavesNothingAboveItsNoise) {
  Render right(1, .25), exact(2, .25), job(3, .25);
  right.to(8), exact.to(2048), job.to(2048);
  const TrueError noisy = true_error(right.reference(), job.image()),
                  told = true_error(exact.reference(), job.image());
  EXPECT_TRUE(below_noise(noisy.relmse, noisy.relmse_stderr));
  EXPECT_TRUE(below_noise(noisy.rmse * noisy.rmse, noisy.mse_stderr));
  // Its standard error is sqrt(8 / 1024) = 9 % of it.
  EXPECT_FALSE(below_noise(told.relmse, told.relmse_stderr));
  EXPECT_FALSE(below_noise(told.rmse * told.rmse, told.mse_stderr));
  EXPECT_TRUE(below_noise(0, 0.));
  EXPECT_FALSE(below_noise(0, std::nullopt));
}

}  // namespace
}  // namespace ls
