// Synthetic images with known noise. Seeds are fixed. The derivation of each threshold is beside it.
#include "core/image/error/error_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/significance.h"

namespace ls {
namespace {

using test::kStandardErrors;
using ::testing::HasSubstr;

constexpr int kErrorSide = 32;
constexpr std::size_t kErrorPixels = kErrorSide * kErrorSide;
constexpr double kErrorDark = 0.01;

struct Trial {
  TileError estimate;
  double realised_mse = 0, realised_relmse = 0;
};
// A function of the pixel and the channel.
using Field = std::function<double(std::size_t, std::size_t)>;
// Draws the errors of the three channels of one half of one pixel, each of unit variance.
using Noise = std::function<std::array<double, 3>(std::mt19937_64&)>;

std::array<double, 3> grey(std::mt19937_64& random) {
  const double v = std::normal_distribution<double>()(random);
  return {v, v, v};
}
std::array<double, 3> coloured(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double r = normal(random), g = normal(random), b = normal(random);
  return {r, g, b};
}
std::array<double, 3> partly_coloured(std::mt19937_64& random) {  // correlation 0.7
  const double common = std::sqrt(0.7) * std::normal_distribution<double>()(random);
  std::array<double, 3> own = coloured(random);
  for (double& v : own) v = common + std::sqrt(0.3) * v;
  return own;
}

// Draws the two halves of an image and estimates its error. `sigma` is the standard deviation of a half's
// mean. The image is the mean of the halves.
Trial run(const Field& truth, const Field& sigma, const Noise& noise, std::mt19937_64& random) {
  std::vector<double> halves[2];
  for (auto& half : halves) half.resize(3 * kErrorPixels);
  for (auto& half : halves)
    for (std::size_t p = 0; p < kErrorPixels; ++p) {
      const auto e = noise(random);
      for (std::size_t c = 0; c < 3; ++c) half[c * kErrorPixels + p] = truth(p, c) + sigma(p, c) * e[c];
    }
  Trial out{estimate_error({kErrorSide, kErrorSide, halves[0], halves[1]}, 128)};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t p = 0; p < kErrorPixels; ++p) {
      const double m = truth(p, c),
                   e = (halves[0][c * kErrorPixels + p] + halves[1][c * kErrorPixels + p]) / 2 - m;
      out.realised_mse += e * e / (3 * kErrorPixels);
      out.realised_relmse += e * e / (m * m + kErrorDark) / (3 * kErrorPixels);
    }
  return out;
}

double bright(std::size_t p, std::size_t c) {
  return 0.5 + 0.3 * std::sin(0.05 * static_cast<double>(p % kErrorSide)) + 0.1 * static_cast<double>(c);
}
double uneven(std::size_t p, std::size_t) {
  return 0.02 + 0.1 * static_cast<double>(p % kErrorSide) / kErrorSide;
}

// Computes the mean of values and the standard error of this mean.
struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, ++n; }
  double mean() const { return sum / n; }
  double stderr_of_mean() const { return std::sqrt((squares / n - mean() * mean()) / (n - 1)); }
};

TEST(ErrorEstimate, IsUnbiasedForTheMeanSquaredError) {
  std::mt19937_64 random(1);
  Mean difference;
  for (int i = 0; i < 1000; ++i) {
    const Trial t = run(bright, uneven, partly_coloured, random);
    difference.add(t.estimate.plain.squares / (3 * kErrorPixels) - t.realised_mse);
  }

  EXPECT_LT(std::abs(difference.mean() / difference.stderr_of_mean()), kStandardErrors);
}

// The fraction of 2000 trials in which a 95 % interval covers the true value has the standard deviation
// sqrt(0.95 * 0.05 / 2000) = 0.0049, so 0.93 and 0.97 are 4.1 standard deviations away.
struct Coverage {
  const char* name;
  Noise noise;
};
class Interval : public ::testing::TestWithParam<Coverage> {};

TEST_P(Interval, CoversTheRealisedErrorNineteenTimesInTwenty) {
  std::mt19937_64 random(2);
  constexpr int kTrials = 2000;
  int rmse = 0, relmse = 0;
  for (int i = 0; i < kTrials; ++i) {
    const Trial t = run(bright, uneven, GetParam().noise, random);
    const ImageError e = image_error(t.estimate);
    const double realised = std::sqrt(t.realised_mse);
    rmse += e.rmse_lo <= realised && realised <= e.rmse_hi;
    relmse += e.relmse_lo <= t.realised_relmse && t.realised_relmse <= e.relmse_hi;
    ASSERT_TRUE(e.trusted) << e.verdict;
  }

  EXPECT_GE(rmse, 0.93 * kTrials);
  EXPECT_LE(rmse, 0.97 * kTrials);
  EXPECT_GE(relmse, 0.93 * kTrials);
  EXPECT_LE(relmse, 0.97 * kTrials);
}

INSTANTIATE_TEST_SUITE_P(Noise, Interval,
                         ::testing::Values(Coverage{"Grey", grey}, Coverage{"Coloured", coloured},
                                           Coverage{"PartlyColoured", partly_coloured}),
                         [](const auto& info) { return std::string(info.param.name); });

// The standard deviation of the noise varies by about 30 % from pixel to pixel, although the image is
// constant. Here the estimate from products of neighbours makes the interval too narrow (90 to 92 %
// coverage), and for Laplace noise the estimate from fourth powers makes it too wide. The estimate from the
// last round is correct.
struct UnevenNoise {
  const char* name;
  Noise noise;
};
class IntervalOfUnevenNoise : public ::testing::TestWithParam<UnevenNoise> {};

TEST_P(IntervalOfUnevenNoise, CoversTheRealisedErrorNineteenTimesInTwenty) {
  std::mt19937_64 random(12);
  std::lognormal_distribution<double> strength(0, .3);
  std::vector<double> sigma(kErrorPixels);
  for (double& s : sigma) s = .1 * strength(random);
  constexpr double kMean = .5;
  constexpr int kTrials = 2000;
  int rmse = 0, relmse = 0;
  for (int i = 0; i < kTrials; ++i) {
    std::vector<double> early[2], whole[2];
    double squares = 0;
    for (int h = 0; h < 2; ++h) early[h].resize(3 * kErrorPixels), whole[h].resize(3 * kErrorPixels);
    for (std::size_t p = 0; p < kErrorPixels; ++p) {
      std::array<double, 3> error{};
      for (int h = 0; h < 2; ++h) {
        const auto before = GetParam().noise(random), last = GetParam().noise(random);
        for (std::size_t c = 0; c < 3; ++c) {
          early[h][c * kErrorPixels + p] = kMean + sigma[p] * before[c];
          whole[h][c * kErrorPixels + p] = kMean + sigma[p] * (before[c] + last[c]) / 2;
          error[c] += sigma[p] * (before[c] + last[c]) / 4;
        }
      }
      for (const double e : error) squares += e * e / (3 * kErrorPixels);
    }
    const EarlierMeans earlier{{kErrorSide, kErrorSide, early[0], early[1]}, 32};
    const ImageError e =
        image_error(estimate_error({kErrorSide, kErrorSide, whole[0], whole[1]}, 64, &earlier));
    const double realised = squares / (kMean * kMean + kErrorDark);
    rmse += e.rmse_lo <= std::sqrt(squares) && std::sqrt(squares) <= e.rmse_hi;
    relmse += e.relmse_lo <= realised && realised <= e.relmse_hi;
    ASSERT_TRUE(e.trusted) << e.verdict;
  }

  // The coverage is binomial; its standard deviation is .0049.
  const double slack = kStandardErrors * std::sqrt(.95 * .05 / kTrials);
  EXPECT_NEAR(rmse / double{kTrials}, .95, slack);
  EXPECT_NEAR(relmse / double{kTrials}, .95, slack);
}

std::array<double, 3> laplace(std::mt19937_64& random) {
  std::exponential_distribution<double> exponential;
  const double v = (exponential(random) - exponential(random)) / std::sqrt(2.);
  return {v, v, v};
}

INSTANTIATE_TEST_SUITE_P(Noise, IntervalOfUnevenNoise,
                         ::testing::Values(UnevenNoise{"Grey", grey}, UnevenNoise{"Coloured", coloured},
                                           UnevenNoise{"HeavyTailed", laplace}),
                         [](const auto& info) { return std::string(info.param.name); });

// In the dark (m = 0) the noise of the window lowers the weight 1/(m^2 + c) by at most a fraction s^2/c,
// where s^2 is the variance of the window's mean: sigma^2/48 inside (24 neighbours, two halves), sigma^2/16
// in a corner. With sigma = 0.1 (a relMSE of 0.5) these are 2.1 % and 6.3 %. The lower bound counts every
// pixel as a corner. The weight is never raised, since 1/(x^2 + c) <= 1/c.
TEST(ErrorEstimate, DenominatorIsNotBiasedByNoiseInTheDark) {
  std::mt19937_64 random(3);
  const double sigma = 0.1;
  Mean ratio;
  for (int i = 0; i < 1000; ++i) {
    const Trial t = run([](auto, auto) { return 0.0; }, [&](auto, auto) { return sigma; }, coloured, random);
    ratio.add(t.estimate.relative.squares / (3 * kErrorPixels) / (sigma * sigma / 2 / kErrorDark));
  }

  EXPECT_GT(ratio.mean(), 1 - sigma * sigma / 16 / kErrorDark);
  EXPECT_LT(ratio.mean(), 1 + kStandardErrors * ratio.stderr_of_mean());
  // Otherwise the bounds above would test nothing.
  EXPECT_LT(ratio.stderr_of_mean(), 0.002);
}

// A firefly must not hide its error by enlarging the denominator of its own pixel.
TEST(ErrorEstimate, CountsFirefliesInFull) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform;
  // A half has a firefly with probability 1/500. The noise has mean 0 and variance 1.
  const auto firefly = [&](std::mt19937_64& r) {
    const double q = 0.002, v = (uniform(r) < q ? 1 - q : -q) / std::sqrt(q * (1 - q));
    return std::array{v, v, v};
  };
  Mean estimated, realised;
  for (int i = 0; i < 1000; ++i) {
    const Trial t = run([](auto, auto) { return 0.2; }, [](auto, auto) { return 0.2; }, firefly, random);
    estimated.add(t.estimate.relative.squares / (3 * kErrorPixels));
    realised.add(t.realised_relmse);
  }

  // A firefly in the window lowers the weights of its neighbours. 24/500 * 2 of the pixels have one in their
  // window, so the sum changes by at most 10 %. (If a pixel were part of its own window, half of the error
  // would be missing.)
  EXPECT_NEAR(estimated.mean() / realised.mean(), 1, 0.1);
}

TEST(ErrorEstimate, SumsOfTilesAreThoseOfTheImage) {
  std::mt19937_64 random(5);
  TileError both;
  for (int i = 0; i < 2; ++i) {
    const Trial t = run(bright, uneven, grey, random);
    TileError expected = both;
    expected.add(t.estimate);
    both.add(t.estimate);
    EXPECT_EQ(both, expected);
  }

  const ImageError e = image_error(both);

  EXPECT_EQ(both.pixels, 2 * kErrorPixels);
  EXPECT_EQ(e.spp, 128);
  EXPECT_DOUBLE_EQ(e.relmse, both.relative.squares / (6 * kErrorPixels));
}

TEST(ErrorEstimate, HeavyTailsAreUntrusted) {
  std::mt19937_64 random(6);
  // A Pareto distribution with tail index 1.1 has no variance.
  const auto pareto = [](std::mt19937_64& r) {
    const double v = std::pow(1 - std::uniform_real_distribution<double>()(r), -1 / 1.1);
    return std::array{v, v, v};
  };
  int distrusted = 0;
  for (int i = 0; i < 100; ++i) {
    const ImageError e = image_error(run(bright, uneven, pareto, random).estimate);
    distrusted += !e.trusted;
    if (!e.trusted) {
      EXPECT_THAT(e.verdict, HasSubstr("don't trust yet"));
    }
  }

  EXPECT_GE(distrusted, 90);
}

// Twelve of 1,024 pixels carry the error. At the edge of a lamp each half has found light; an outlier is in
// one half.
TEST(ErrorEstimate, FewPixelsThatCarryTheErrorAreUntrustedOnlyIfTheirLightIsInOneHalf) {
  std::vector<double> a(3 * kErrorPixels, 1.0), edge(3 * kErrorPixels, 1.0), outliers(3 * kErrorPixels, 1.0);
  for (std::size_t i = 0; i < 3 * kErrorPixels; ++i) {
    if (i % kErrorPixels % 85 != 3) continue;
    edge[i] = 3;
    outliers[i] = 30;
  }

  const ImageError settled = image_error(estimate_error({kErrorSide, kErrorSide, a, edge}, 64));
  const ImageError doubtful = image_error(estimate_error({kErrorSide, kErrorSide, a, outliers}, 64));

  EXPECT_NEAR(settled.effective_pixels, 13, .5);
  EXPECT_TRUE(settled.trusted) << settled.verdict;
  EXPECT_FALSE(doubtful.trusted);
}

// The noise of one pixel in a hundred is ten times as large as that of all others together. They are bright,
// so that relative errors are alike.
TEST(ErrorEstimate, RmseHasNoIntervalWhereFewBrightPixelsCarryIt) {
  std::mt19937_64 random(15);
  const auto glints = [](std::size_t p, std::size_t) { return p % 128 == 5 ? 1000. : 1.; };
  const auto relative = [&](std::size_t p, std::size_t c) { return .1 * glints(p, c); };

  const ImageError some = image_error(run(glints, relative, grey, random).estimate);
  const ImageError none = image_error(run(bright, uneven, grey, random).estimate);
  // A pixel in eight, with Gaussian noise: they count as 43, and 64 are asked of an image of 1,024.
  const auto one_in_eight = [](std::size_t p, std::size_t) { return p % 8 == 5 ? .1 : .001; };
  const ImageError several = image_error(run(bright, one_in_eight, grey, random).estimate);

  ASSERT_TRUE(some.trusted) << some.verdict;
  EXPECT_EQ(some.rmse_lo, 0);
  EXPECT_EQ(some.rmse_hi, 0);
  EXPECT_GT(some.relmse_lo, 0);
  EXPECT_GT(some.relmse_hi, some.relmse);
  ASSERT_TRUE(several.trusted) << several.verdict;
  EXPECT_EQ(several.rmse_hi, 0);
  EXPECT_GT(none.rmse_lo, 0);
  EXPECT_GT(none.rmse_hi, none.rmse);
}

// One half of a pixel is 9, all else is 1. If the pixel is like its neighbours, half A holds an outlier; if
// it is as bright as it looks (5), its weight is 1 / 25.01.
TEST(ErrorEstimate, IntervalReachesLowerByOutliersThatMayBeBrightPixels) {
  std::vector<double> a(3 * kErrorPixels, 1.0), b(3 * kErrorPixels, 1.0);
  for (std::size_t c = 0; c < 3; ++c) a[c * kErrorPixels + 10 * kErrorSide + 10] = 9;

  const TileError told = estimate_error({kErrorSide, kErrorSide, a, b}, 64);
  TileError sure = told;
  sure.unsure_weights = 0;

  const double delta = 3 * 16 * (1 / 1.01 - 1 / 25.01);
  EXPECT_NEAR(told.unsure_weights, delta * delta, 1e-12 * delta * delta);  // rounding of a few sums
  const ImageError image = image_error(told), without = image_error(sure);
  EXPECT_DOUBLE_EQ(image.relmse_lo, without.relmse_lo * std::exp(-delta / told.relative.squares));
  EXPECT_EQ(image.relmse_hi, without.relmse_hi);
  EXPECT_EQ(image.relmse, without.relmse);
}

TEST(ErrorEstimate, BrightPixelsWithLightInBothHalvesAreNoOutliers) {
  std::vector<double> a(3 * kErrorPixels, 1.0), b(3 * kErrorPixels, 1.0);
  for (std::size_t c = 0; c < 3; ++c) {
    a[c * kErrorPixels + 10 * kErrorSide + 10] = 9;
    b[c * kErrorPixels + 10 * kErrorSide + 10] = 8;
  }

  EXPECT_EQ(estimate_error({kErrorSide, kErrorSide, a, b}, 64).unsure_weights, 0);
}

TEST(ErrorEstimate, LowerEndStaysAboveZeroForAllPixels) {
  std::vector<double> a(3 * kErrorPixels, 1.0), b(3 * kErrorPixels, 1.0);
  a[17] = 1e6;

  const ImageError e = image_error(estimate_error({kErrorSide, kErrorSide, a, b}, 64));

  EXPECT_GT(e.relmse_lo, 0);
  EXPECT_LT(e.relmse_lo, e.relmse);
  EXPECT_GT(e.relmse_hi, e.relmse);
  EXPECT_NEAR(e.effective_pixels, 1, 1e-9);
  EXPECT_FALSE(e.trusted);
}

TEST(ErrorEstimate, EqualHalvesHaveNoErrorAndAreTrustedOnlyAfterSomeSamples) {
  const std::vector<double> flat(3 * kErrorPixels, 0.25);

  const ImageError early = image_error(estimate_error({kErrorSide, kErrorSide, flat, flat}, 2));
  const ImageError late = image_error(estimate_error({kErrorSide, kErrorSide, flat, flat}, 64));

  EXPECT_EQ(early.relmse, 0);
  EXPECT_EQ(early.relmse_hi, 0);
  EXPECT_FALSE(early.trusted);
  EXPECT_TRUE(late.trusted);
  EXPECT_EQ(image_error(TileError{}).relmse, 0);
}

TEST(ErrorEstimate, IsUntrustedIfNoSampleFoundLight) {
  std::vector<double> black(3 * kErrorPixels), spark(3 * kErrorPixels);
  spark[17] = 1;

  const ImageError dark = image_error(estimate_error({kErrorSide, kErrorSide, black, black}, 4096));

  EXPECT_EQ(dark.relmse, 0);
  EXPECT_FALSE(dark.trusted);
  EXPECT_NE(dark.verdict.find("no sample has found any light"), std::string::npos) << dark.verdict;
  EXPECT_TRUE(image_error(estimate_error({kErrorSide, kErrorSide, spark, spark}, 4096)).trusted);
}

TEST(ErrorEstimate, WorksOnTilesOfAnyShape) {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {5, 3}}) {
    const auto n = static_cast<std::size_t>(w * h);
    std::vector<double> a(3 * n, 0.5), b(3 * n, 0.3);

    const ImageError e = image_error(estimate_error({w, h, a, b}, 64));

    EXPECT_NEAR(e.rmse, 0.1, 1e-15) << w << " x " << h;  // |A - B| / 2
    // The correction for noise lowers a weight by at most half.
    EXPECT_LE(e.relmse, 0.01 / (0.4 * 0.4 + 0.01) * (1 + 1e-12)) << w << " x " << h;
    EXPECT_GE(e.relmse, 0.01 / (0.4 * 0.4 + 0.01) / 2) << w << " x " << h;
  }
}

TEST(FewHits, ArePixelsWithLightInOneHalfOnly) {
  std::vector<double> a(3 * kErrorPixels, 1.0), b(3 * kErrorPixels, 1.0);
  const auto set = [&](std::size_t p, double in_a, double in_b) {
    for (std::size_t c = 0; c < 3; ++c) a[c * kErrorPixels + p] = in_a, b[c * kErrorPixels + p] = in_b;
  };
  set(100, 1, 0);
  set(200, 1, 20);
  set(300, 1, 18);  // below the ratio of 19
  set(400, 0, 0);   // black, but its neighbours are lit

  const HalfMeans halves{kErrorSide, kErrorSide, a, b};

  EXPECT_EQ(estimate_error(halves, 64).few_hits, 3u);
  EXPECT_EQ(image_error(estimate_error(halves, 64)).few_hits, 3u);
  EXPECT_TRUE(has_few_hits(halves, 100 % kErrorSide, 100 / kErrorSide));
  EXPECT_FALSE(has_few_hits(halves, 300 % kErrorSide, 300 / kErrorSide));
}

TEST(FewHits, ExcludePixelsAlongASilhouette) {
  std::vector<double> half(3 * kErrorPixels);
  for (std::size_t i = 0; i < half.size(); ++i)
    // The left part is lit, the rest is black.
    half[i] = i % kErrorSide < 11 ? 1 : 0;

  EXPECT_EQ(estimate_error({kErrorSide, kErrorSide, half, half}, 64).few_hits, 0u);
}

TileError figures(double value) { return TileError{.pixels = 1, .samples = 1, .plain = {.squares = value}}; }

TEST(Checkpoints, CompleteWhenAllTilesHaveTheRound) {
  Checkpoints points(3);
  points.folded(0, 0, figures(1));
  points.folded(0, 1, figures(10));
  points.folded(2, 0, figures(3));
  EXPECT_EQ(points.complete(), 0u);

  points.folded(1, 0, figures(2));
  ASSERT_EQ(points.complete(), 1u);
  EXPECT_EQ(points.at(0).plain.squares, 6);

  points.folded(2, 1, figures(30));
  points.folded(1, 1, figures(20));
  ASSERT_EQ(points.complete(), 2u);
  EXPECT_EQ(points.at(1).plain.squares, 60);
}

TEST(Checkpoints, StoppedTilesKeepTheirLastFigures) {
  Checkpoints points(2);
  points.folded(0, 0, figures(1));
  points.stopped(0);
  points.folded(1, 0, figures(2));
  points.folded(1, 1, figures(3));
  EXPECT_EQ(points.complete(), 2u);
  EXPECT_EQ(points.at(1).plain.squares, 4);

  points.stopped(1);
  EXPECT_EQ(points.complete(), 2u);

  // The tile continues: the complete checkpoint of round 1 stays, that of round 2 uses the new figures.
  points.folded(0, 1, figures(9));
  points.folded(0, 2, figures(10));
  EXPECT_EQ(points.at(1).plain.squares, 4);
  ASSERT_EQ(points.complete(), 3u);
  EXPECT_EQ(points.at(2).plain.squares, 13);
}

TEST(Checkpoints, ReplacedRoundUsesTheNewerFigures) {
  Checkpoints points(2);
  points.folded(0, 0, figures(1));
  points.folded(0, 1, figures(5));
  points.folded(0, 1, figures(7));
  points.folded(1, 0, figures(1));
  points.folded(1, 1, figures(1));

  ASSERT_EQ(points.complete(), 2u);
  EXPECT_EQ(points.at(1).plain.squares, 8);
}

}  // namespace
}  // namespace ls
