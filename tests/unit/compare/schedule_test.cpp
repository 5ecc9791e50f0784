// Tests the turns and rounds of a race at given times.
#include "compare/racer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace ls::race {
namespace {

// Simulates a race of racers with these lengths of turns until each has used 10 s. Returns who ran, in order.
std::vector<std::size_t> play(const std::vector<double>& lengths, std::size_t first_lap = 0) {
  std::vector<Turn> turns;
  for (const double length : lengths) turns.push_back({false, 0, length});
  std::vector<std::size_t> order;
  for (std::size_t lap = first_lap;; ++lap) {
    const auto next = next_turn(turns, lap);
    if (!next) return order;
    Turn& turn = turns[*next];
    turn.used += turn.expected;
    turn.done = turn.used >= 10;
    order.push_back(*next);
  }
}

TEST(Turns, ShortOnesAlternate) {
  const auto order = play({1, 1});

  ASSERT_EQ(order.size(), 20u);
  for (std::size_t i = 0; i < order.size(); i += 2) EXPECT_NE(order[i], order[i + 1]) << i;
}

TEST(Turns, NobodyIsEverAheadByMoreThanOneTurn) {
  const std::vector<double> lengths{.5, 2, 1};
  std::vector<double> used(3);
  for (const std::size_t who : play(lengths)) {
    used[who] += lengths[who];
    const double least = *std::min_element(used.begin(), used.end());
    EXPECT_LE(used[who] - least, 2 + .5);
  }
}

TEST(Turns, EachSeedBeginsWithAnother) {
  EXPECT_EQ(play({1, 1, 1}, 0).front(), 0u);
  EXPECT_EQ(play({1, 1, 1}, 1).front(), 1u);
  EXPECT_EQ(play({1, 1, 1}, 2).front(), 2u);
}

TEST(Turns, EndWhenAllAreDone) {
  EXPECT_FALSE(next_turn(std::array{Turn{true, 1, 0}, Turn{true, 2, 0}}, 5));
  EXPECT_FALSE(next_turn({}, 0));
}

TEST(RoundsOfARace, AreThoseOfAJobWhileTheyFit) {
  constexpr std::uint64_t kNoLimit = 1 << 20;
  EXPECT_EQ(next_range(0, 0, 10, kNoLimit), (SampleRange{0, 2}));
  EXPECT_EQ(next_range(3, .1, 10, kNoLimit), (SampleRange{8, 16}));
  EXPECT_EQ(next_range(7, .1, 10, kNoLimit), (SampleRange{128, 192}));
}

TEST(RoundsOfARace, AreCutToTheTimeLeft) {
  constexpr std::uint64_t kNoLimit = 1 << 20;
  EXPECT_EQ(next_range(7, .1, 3.15, kNoLimit),
            (SampleRange{128, 158}));             // 31 samples fit, an even number is rendered
  EXPECT_FALSE(next_range(7, .1, .5, kNoLimit));  // 5 fit; the even 4 are fewer than 128 / 16
  EXPECT_FALSE(next_range(3, .1, 0, kNoLimit));
  EXPECT_FALSE(next_range(3, .1, -2, kNoLimit));
}

TEST(RoundsOfARace, EndAtTheSamplesAskedFor) {
  EXPECT_EQ(next_range(6, .1, 1e9, 100), (SampleRange{64, 100}));
  EXPECT_EQ(next_range(0, 0, 1e9, 1), (SampleRange{0, 2}));
  EXPECT_FALSE(next_range(6, .1, 1e9, 64));
}

TEST(Costs, CpuSecondsCountByTheThread) {
  const Cost cost{3, 8};
  EXPECT_EQ(cost.seconds(RaceClock::wall, 4), 3);
  EXPECT_EQ(cost.seconds(RaceClock::cpu, 4), 2);
}

}  // namespace
}  // namespace ls::race
