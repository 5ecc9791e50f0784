#include "worker/agent/gap_meter.h"

#include <gmock/gmock.h>

namespace ls::worker {
namespace {

TEST(GapMeter, KnowsNothingOfNoGaps) {
  const GapMeter gaps;
  EXPECT_EQ(gaps.count(), 0u);
  EXPECT_EQ(gaps.quantile(.5), 0);
}

TEST(GapMeter, SaysQuantilesToAStepOfItsHistogram) {
  GapMeter gaps;
  for (int i = 1; i <= 1000; ++i) gaps.add(i * 1e-5);  // 10 us to 10 ms
  EXPECT_EQ(gaps.count(), 1000u);
  EXPECT_THAT(gaps.text(), testing::HasSubstr("longest 10.00 ms"));
  // quantile() returns the upper end of the bucket that contains the quantile, so it is never too small, and
  // too large by a factor of at most 2^(1/8).
  for (const double q : {.01, .5, .99}) {
    EXPECT_GE(gaps.quantile(q), q * 1e-2 * (1 - 1e-12)) << q;
    EXPECT_LE(gaps.quantile(q), q * 1e-2 * 1.0906) << q;
  }
  EXPECT_DOUBLE_EQ(gaps.quantile(1), 1e-2);
}

TEST(GapMeter, TakesWhatClocksMakeOfNoGapAtAllAndWhatNoBucketHolds) {
  GapMeter gaps;
  gaps.add(-1e-7);
  gaps.add(1e9);
  EXPECT_EQ(gaps.count(), 2u);
  EXPECT_NEAR(gaps.quantile(.5), 0, 1.1e-6) << "the end of the first bucket";
  EXPECT_DOUBLE_EQ(gaps.quantile(1), 1e9);
}

}  // namespace
}  // namespace ls::worker
