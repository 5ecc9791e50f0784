// The stop rule alone: which tiles stop together, which tiles get samples, and that the order of results has
// no influence.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "coordinator/domain/adaptive_stop.h"
#include "coordinator/domain/limits.h"
#include "tests/unit/domain/stop_oracle.h"

namespace ls::coordinator {
namespace {

constexpr std::uint64_t kMany = 65536;
constexpr double kTileValues = 32 * 32 * 3;

TileGrid tiles_in_a_row(int n) { return {{32 * n, 32}, 32}; }

// Errors, without noise, of tiles with these variances per sample.
ErrorOf exact(std::vector<double> variance) {
  return [variance = std::move(variance)](TileIndex t, RoundIndex k) {
    return variance[t] * kTileValues / static_cast<double>(round_range(k).s1);
  };
}

std::uint64_t spp_of(const StopOutcome& out, TileIndex t) { return round_range(out.ends[t] - 1).s1; }

TEST(StopGroups, HaveEnoughPixelsAndEveryTileOnce) {
  std::mt19937 random(7);
  const auto pick = [&](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
  for (int i = 0; i < 2000; ++i) {
    const TileGrid grid{{pick(1, 300), pick(1, 300)}, pick(8, 80)};
    const int pixels = grid.frame.width * grid.frame.height;
    std::vector<int> seen(grid.count());
    for (const auto& group : stop_groups(grid)) {
      std::int64_t sum = 0;
      for (const TileIndex t : group) sum += grid.rect(t).pixels(), ++seen[t];
      EXPECT_GE(sum, std::min(pixels, kMinStopPixels))
          << grid.frame.width << " x " << grid.frame.height << " by " << grid.tile;
    }
    for (const int n : seen) ASSERT_EQ(n, 1);
  }
}

TEST(StopGroups, AreSingleTilesExceptTruncatedOnesAtTheEdge) {
  const auto groups = stop_groups({{1920, 1080}, 32});  // 60 x 33 whole tiles, and a row 24 pixels high
  EXPECT_EQ(groups.size(), 60u * 33u);
  EXPECT_EQ(groups[0], std::vector<TileIndex>{0});
  EXPECT_EQ(groups[32 * 60], (std::vector<TileIndex>{32 * 60, 33 * 60}));
  EXPECT_EQ(stop_groups({{64, 64}, 8}).size(), 4u) << "blocks of 4 x 4 tiles";
  EXPECT_EQ(stop_groups({{20, 20}, 32}).size(), 1u);
}

TEST(Level, IsRoundedDownToTheGrid) {
  const double step = std::exp2(-.25);
  std::mt19937_64 random(3);
  for (int i = 0; i < 10000; ++i) {
    const double gain = std::exp2(std::uniform_real_distribution(-80., 20.)(random));
    const double level = level_below(gain);
    EXPECT_LT(level, gain);
    EXPECT_GE(level, gain * step * (1 - 1e-15));
    const double steps = 4 * std::log2(level);  // a whole number of the grid's steps, up to rounding
    EXPECT_NEAR(steps, std::round(steps), 1e-10);
    EXPECT_LT(level_below(level), level);
  }
  EXPECT_EQ(level_below(1), std::exp2(-.25));
  EXPECT_EQ(level_below(0), 0);
}

TEST(AdaptiveStop, NoTileStopsBeforeSixtyFourSamples) {
  const auto out = stop_at_once(tiles_in_a_row(2), kMany, 1e9, exact({1e-9, 1}));
  EXPECT_TRUE(out.by_error);
  EXPECT_EQ(spp_of(out, 0), 64u);
  EXPECT_EQ(spp_of(out, 1), 64u);
}

TEST(AdaptiveStop, SamplesGrowWithTheRootOfTheVariance) {
  // n is proportional to sqrt(a): 1, 2, 4 and 8 times as many samples, up to one round and one level (2^1/8
  // of n).
  const auto out = stop_at_once(tiles_in_a_row(4), kMany, 2e-3, exact({1, 4, 16, 64}));
  ASSERT_TRUE(out.by_error);
  const double least = static_cast<double>(spp_of(out, 0));
  ASSERT_GT(least, 640);
  for (TileIndex t = 1; t < 4; ++t) {
    const double times = static_cast<double>(spp_of(out, t)) / least;
    EXPECT_NEAR(times, std::exp2(t), std::exp2(t) * (64 / least + .091));
  }
}

// The least mean of n, under the condition mean(a/n) = T, is mean(sqrt a)^2 / T. The grids of rounds and
// levels cost up to one round and one level more.
TEST(AdaptiveStop, ReachesTheTargetNearTheMinimalCost) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 50; ++i) {
    std::vector<double> a(40);
    double roots = 0, mean = 0;
    for (double& v : a) {
      v = std::exp(std::normal_distribution(0., 2.)(random));
      roots += std::sqrt(v) / 40, mean += v / 40;
    }
    const double target = roots * roots / 3000;  // the least mean is 3000 samples per pixel
    const auto out = stop_at_once(tiles_in_a_row(40), kMany, target, exact(a));
    EXPECT_LE(out.predicted, target);
    EXPECT_LE(out.mean_spp, 3000 * 1.0905 + 96) << "a level of n, a round and the 64 that all get";
    EXPECT_LT(out.mean_spp, mean / target) << "uniform sampling";
  }
}

// The error after a tile's own last round would bias the decision towards stopping: however low it is, the
// tile does not end earlier.
TEST(AdaptiveStop, LastRoundOfATileDoesNotDecideItsStop) {
  const auto honest = exact({2, 3});
  const auto out = stop_at_once(tiles_in_a_row(2), kMany, 5e-3, honest);
  const ErrorOf other = [&](TileIndex t, RoundIndex k) {
    return honest(t, k) * (k == out.ends[t] - 1 ? 1e-6 : 1);
  };
  EXPECT_EQ(stop_at_once(tiles_in_a_row(2), kMany, 5e-3, other).ends, out.ends);
}

TEST(AdaptiveStop, ImageWorseThanPredictedContinues) {
  const auto honest = exact({2, 3});
  const auto out = stop_at_once(tiles_in_a_row(2), kMany, 5e-3, honest);
  const ErrorOf late = [&](TileIndex t, RoundIndex k) {  // one very bright sample comes in the last round
    return honest(t, k) * (t == 1 && k >= out.ends[t] - 1 ? 2 : 1);
  };
  const auto further = stop_at_once(tiles_in_a_row(2), kMany, 5e-3, late);
  EXPECT_TRUE(further.by_error);
  EXPECT_GT(further.ends[1], out.ends[1]);
}

// Errors whose rounds scatter independently.
ErrorOf noisy(std::vector<double> variance, std::uint64_t seed) {
  return [variance = std::move(variance), seed](TileIndex t, RoundIndex k) {
    std::mt19937_64 random(seed + 1000003 * t + k);
    const double scatter = std::uniform_real_distribution(.7, 1.4)(random);
    return scatter * variance[t] * kTileValues / static_cast<double>(round_range(k).s1);
  };
}

TEST(AdaptiveStop, TheOrderOfArrivalDoesNotMatter) {
  const TileGrid grid{{32 * 5 + 9, 32 * 3 + 30}, 32};
  std::vector<double> a(grid.count());
  std::mt19937_64 random(5);
  for (double& v : a) v = std::exp(std::normal_distribution(0., 1.5)(random));
  const ErrorOf error = noisy(a, 17);
  const auto straight = stop_at_once(grid, kMany, .004, error);
  for (int i = 0; i < 50; ++i) {
    AdaptiveStop rule(grid, kMany);
    std::vector<RoundIndex> seen(grid.count());
    while (rule.judge(.004) != AdaptiveStop::Verdict::yes) {
      if (rule.judge(.004) == AdaptiveStop::Verdict::no) rule.lower();
      const TileIndex t = static_cast<TileIndex>(random() % grid.count());
      if (seen[t] <= rule.wanted(t)) rule.folded(t, seen[t], error(t, seen[t])), ++seen[t];
    }
    ASSERT_EQ(rule.ends(), straight.ends);
  }
}

TEST(AdaptiveStop, LoweredTargetEndsWhereANewJobWithItWouldEnd) {
  const TileGrid grid = tiles_in_a_row(20);
  std::mt19937_64 random(6);
  for (int i = 0; i < 100; ++i) {
    std::vector<double> a(grid.count());
    for (double& v : a) v = std::exp(std::normal_distribution(0., 1.5)(random));
    const ErrorOf error = noisy(a, random());
    AdaptiveStop rule(grid, 20000);
    std::vector<RoundIndex> seen(grid.count());
    double target = .1;
    stop_at(rule, seen, target, error);
    feed_wanted(rule, seen, error);  // everything is folded, and the job is done
    target /= std::uniform_real_distribution(1.5, 8.)(random);
    EXPECT_EQ(stop_at(rule, seen, target, error).ends, stop_at_once(grid, 20000, target, error).ends);
  }
}

TEST(AdaptiveStop, WithoutErrorFiguresAllSamplesAreRendered) {
  const auto unknown = [](TileIndex t, RoundIndex) { return t == 1 ? std::nan("") : 0.; };
  const auto out = stop_at_once(tiles_in_a_row(3), 1000, 1e-3, unknown);
  EXPECT_FALSE(out.by_error);
  EXPECT_EQ(out.ends, std::vector<RoundIndex>(3, round_count(1000)));
}

TEST(AdaptiveStop, SmallSampleCountsAreRenderedCompletely) {
  for (const std::uint64_t spp : {2, 3, 16, 63, 64}) {
    const auto out = stop_at_once(tiles_in_a_row(2), spp, 1e3, exact({1, 1}));
    EXPECT_FALSE(out.by_error) << spp;
    EXPECT_EQ(out.ends[1], round_count(spp)) << spp;
  }
}

TEST(AdaptiveStop, PredictsWhereItWillEnd) {
  const TileGrid grid = tiles_in_a_row(3);
  const auto error = exact({1, 9, 100});
  AdaptiveStop rule(grid, kMany);
  EXPECT_FALSE(rule.samples_left());
  for (TileIndex t = 0; t < 3; ++t)
    for (RoundIndex k = 0; k < 3; ++k) rule.folded(t, k, error(t, k));
  rule.foresee(.003);
  const auto out = stop_at_once(grid, kMany, .003, error);
  for (TileIndex t = 0; t < 3; ++t) {
    const double there = static_cast<double>(spp_of(out, t)),
                 told = static_cast<double>(round_range(rule.predicted_last(t) - 1).s1);
    EXPECT_NEAR(told, there, .091 * there + 64) << t;
  }
  EXPECT_NEAR(*rule.samples_left(), 3 * 1024 * (out.mean_spp - 8), 3 * 1024 * (.091 * out.mean_spp + 64));
}

}  // namespace
}  // namespace ls::coordinator
