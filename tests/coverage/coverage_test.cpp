// The short look at tests/coverage: a few seconds. docs/error.md has the long one.
#include "tests/coverage/coverage.h"
#include "tests/coverage/denominators.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace ls::test {
namespace {

constexpr int kJobs = 100;

CoverageScene scene_of(const std::string& name, std::uint64_t spp) {
  for (CoverageScene scene : coverage_scenes())
    if (scene.name == name) {
      scene.spp = spp;
      return scene;
    }
  throw std::runtime_error("there is no scene " + name);
}

// Of n jobs a share of .95 +- sqrt(.95 .05 / n) is covered if the interval is right: with four of these on
// each side chance fails one of 16,000. Besides it, .02 for what the long run is allowed to be off by.
constexpr double kNominal = .95;
const double kSlack = 4 * std::sqrt(.95 * .05 / kJobs) + .02;
constexpr double kRatio = .03;  // what the long run of 64 samples is allowed, of both ratios

class ShortCoverage : public ::testing::TestWithParam<const char*> {};

TEST_P(ShortCoverage, TheIntervalHoldsTheTrueErrorAndTheEstimateIsRightInTheMean) {
  const CoverageScene scene = scene_of(GetParam(), 32);
  const Coverage c = measure_coverage(scene, kJobs, 2);
  fmt::print("{}\n", coverage_line(scene, c));

  EXPECT_NEAR(c.rmse, kNominal, kSlack);
  EXPECT_NEAR(c.relmse, kNominal, kSlack);
  EXPECT_NEAR(c.mse_ratio.value, 1, kRatio + 4 * c.mse_ratio.sigma);
  EXPECT_NEAR(c.relmse_ratio.value, 1, kRatio + 4 * c.relmse_ratio.sigma);
  EXPECT_LT(c.mse_ratio.sigma, .05);  // or the bounds would say nothing
  // "Don't trust yet" is for others: of n jobs that each say it with probability .05, four deviations more
  // once in 16,000.
  EXPECT_LE(c.heavy_tail, .05 + 4 * std::sqrt(.05 * .95 / kJobs));
}

INSTANTIATE_TEST_SUITE_P(Scenes, ShortCoverage,
                         ::testing::Values("surfaces, noisy", "media, noisy", "surfaces, smooth"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase_if(name, [](char c) { return c == ',' || c == ' '; });
                           return name;
                         });

// Jobs that stop at a target choose how long they go on by the very noise that they measure. Few jobs: it is
// the ratios that would tell; of 40 shares four standard deviations are .14.
TEST(ShortCoverage, HoldsForJobsThatStopAtATarget) {
  CoverageScene scene = scene_of("surfaces, smooth", 4096);
  scene.target = 4e-4;
  const Coverage c = measure_coverage(scene, 40, 2);
  fmt::print("{}\n", coverage_line(scene, c));

  EXPECT_GT(c.spp, 64) << "or no tile has chosen anything";
  EXPECT_GE(c.relmse, kNominal - 4 * std::sqrt(.95 * .05 / 40) - .02);
  EXPECT_NEAR(c.mse_ratio.value, 1, kRatio + 4 * c.mse_ratio.sigma);
  EXPECT_NEAR(c.relmse_ratio.value, 1, kRatio + 4 * c.relmse_ratio.sigma);
  EXPECT_LT(c.relmse_ratio.sigma, .05);
}

// Of 24 jobs that each say it with probability .95 or more, fewer than 19 do in one of 1,600 runs (binomial).
TEST(ShortCoverage, FirefliesAreNotTrusted) {
  const CoverageScene scene = scene_of("fireflies", 64);
  const Coverage c = measure_coverage(scene, 24, 2);
  fmt::print("{}\n", coverage_line(scene, c));

  EXPECT_GE(c.heavy_tail, 19. / 24);
}

// What is left of the denominator's noise is of second order (error_estimate.h): where it is dark and relMSE
// below .2, 3 s^4 / c^2 with s^2 = v / 24 to v / 8 (inside and in a corner) is at most 3 (.2 / 8)^2 = .2 %,
// and as much again from g, which is not quite 0. Edges are known once their height is several times the
// noise: at the least noise, where relMSE is near .001, all pictures are held to the 3 % that is promised of
// real ones; `dots` are single pixels, the worst there is.
TEST(Denominator, IsNotBiasedByTheNoiseItMeasures) {
  for (const DenominatorRow& row : measure_denominators(200)) {
    fmt::print("{}\n", denominator_line(row));
    const bool dark = row.picture.starts_with("black") || row.picture.starts_with("dark");
    const double least_noise = .004;
    if (dark && row.relmse < .2) {
      EXPECT_NEAR(row.ours.value, 1, .005 + 4 * row.ours.sigma) << row.picture;
    } else if (row.relmse < least_noise) {
      EXPECT_NEAR(row.ours.value, 1, .03 + 4 * row.ours.sigma) << row.picture;
    }
  }
}

}  // namespace
}  // namespace ls::test
