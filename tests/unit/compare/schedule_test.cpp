// Tests the rounds of a race at given times.
#include "compare/racer.h"

#include <gtest/gtest.h>

namespace ls::race {
namespace {

TEST(RoundsOfARace, MatchAJobsRoundsWhileTheyFit) {
  constexpr std::uint64_t kNoLimit = 1 << 20;
  EXPECT_EQ(next_range(0, 0, 10, kNoLimit), (SampleRange{0, 2}));
  EXPECT_EQ(next_range(3, .1, 10, kNoLimit), (SampleRange{8, 16}));
  EXPECT_EQ(next_range(7, .1, 10, kNoLimit), (SampleRange{128, 192}));
}

TEST(RoundsOfARace, AreShortenedToTheRemainingTime) {
  constexpr std::uint64_t kNoLimit = 1 << 20;
  EXPECT_EQ(next_range(7, .1, 3.15, kNoLimit),
            (SampleRange{128, 158}));             // 31 samples fit, an even number is rendered
  EXPECT_FALSE(next_range(7, .1, .5, kNoLimit));  // 5 fit; the even 4 are fewer than 128 / 16
  EXPECT_FALSE(next_range(3, .1, 0, kNoLimit));
  EXPECT_FALSE(next_range(3, .1, -2, kNoLimit));
}

TEST(RoundsOfARace, EndAtTheRequestedSamples) {
  EXPECT_EQ(next_range(6, .1, 1e9, 100), (SampleRange{64, 100}));
  EXPECT_EQ(next_range(0, 0, 1e9, 1), (SampleRange{0, 2}));
  EXPECT_FALSE(next_range(6, .1, 1e9, 64));
}

TEST(Costs, CpuSecondsAreMeasuredPerThread) {
  const Cost cost{3, 8};
  EXPECT_EQ(cost.seconds(RaceClock::wall, 4), 3);
  EXPECT_EQ(cost.seconds(RaceClock::cpu, 4), 2);
}

}  // namespace
}  // namespace ls::race
