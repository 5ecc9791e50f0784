// Tests intervals over seeds against values that were computed by hand.
#include "compare/summary.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace ls::race {
namespace {

constexpr double kRounding = 1e-9;  // far above the 1e-15 of a few operations in double

TEST(SeedStatistics, IntervalIsStudents) {
  const std::array values{1., 2., 3., 4., 5.};

  const auto m = mean(values);

  // The standard deviation is sqrt(2.5); by the tables, Student's t(.975, 4) is 2.776445
  const double half = 2.7764451052 * std::sqrt(2.5 / 5);
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->value, 3, kRounding);
  EXPECT_NEAR(m->lo, 3 - half, 1e-8);
  EXPECT_NEAR(m->hi, 3 + half, 1e-8);
}

TEST(SeedStatistics, GeometricMeanIsThatOfLogarithms) {
  const std::array values{.01, 1., 100.};

  const auto m = geometric_mean(values);

  // The logarithms are -L, 0 and L with L = ln 100, so their standard deviation is L; t(.975, 2) = 4.302653
  const double half = 4.3026527297 * std::log(100.) / std::sqrt(3.);
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->value, 1, kRounding);
  EXPECT_NEAR(std::log(m->lo), -half, 1e-7);
  EXPECT_NEAR(std::log(m->hi), half, 1e-7);
}

TEST(SeedStatistics, OneSeedSaysNothingOfItsSpread) {
  const std::array one{2.};

  EXPECT_EQ(geometric_mean(one)->lo, 0);
  EXPECT_TRUE(std::isinf(geometric_mean(one)->hi));
  EXPECT_FALSE(mean({}));
}

TEST(SeedStatistics, RefusesWhatHasNoLogarithm) {
  for (const double bad : {0., -1., std::nan(""), HUGE_VAL}) {
    const std::array values{1., bad};
    EXPECT_FALSE(geometric_mean(values)) << bad;
    EXPECT_FALSE(geometric_ratio(values, std::array{1., 1.})) << bad;
    EXPECT_FALSE(geometric_ratio(std::array{1., 1.}, values)) << bad;
  }
  EXPECT_FALSE(geometric_ratio(std::array{1.}, std::array{1., 1.}));
}

// The machine is three times as slow for one seed, for both entrants: this cancels in the ratio.
TEST(SeedStatistics, WhatBothHaveInCommonDropsOutOfARatio) {
  const std::array a{2., 6., 2.}, b{1., 3., 1.};

  const auto ratio = geometric_ratio(a, b);

  EXPECT_NEAR(ratio->value, 2, kRounding);
  EXPECT_NEAR(ratio->lo, 2, kRounding);
  EXPECT_NEAR(ratio->hi, 2, kRounding);
}

TEST(SeedStatistics, SlopeOfAPowerIsItsExponent) {
  std::vector<TimeError> points;
  for (const double t : {.5, 1., 2., 8.}) points.push_back({t, 3 * std::pow(t, -1.25)});
  points.push_back({4, -1});  // below the reference's noise: left out

  EXPECT_NEAR(*log_slope(points), 1.25, kRounding);
}

TEST(SeedStatistics, SlopeNeedsThreePointsAtDifferentTimes) {
  EXPECT_FALSE(log_slope(std::array{TimeError{1, 1}, TimeError{2, .5}}));
  EXPECT_FALSE(log_slope(std::array{TimeError{1, 1}, TimeError{1, .5}, TimeError{1, .3}}));
}

}  // namespace
}  // namespace ls::race
