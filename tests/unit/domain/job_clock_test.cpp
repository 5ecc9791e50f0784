#include "coordinator/domain/job_clock.h"

#include <gtest/gtest.h>

namespace ls::coordinator {
namespace {

constexpr TimePoint kNoon{std::chrono::hours(12)};

TimePoint after(int seconds) { return kNoon + std::chrono::seconds(seconds); }

TEST(JobClock, ShowsNothingBeforeItStarts) {
  JobClock clock;

  clock.stand_still(after(1));
  clock.go_on(after(2));

  EXPECT_FALSE(clock.started());
  EXPECT_EQ(clock.shows(after(9)), 0);
  EXPECT_EQ(clock.zero(after(9)), std::nullopt);
}

TEST(JobClock, StandsStillFromTheFirstStopUntilItGoesOn) {
  JobClock clock;
  clock.start(after(0));

  clock.stand_still(after(10));
  clock.stand_still(after(15));
  EXPECT_EQ(clock.shows(after(20)), 10);
  EXPECT_EQ(clock.zero(after(20)), after(10));
  clock.go_on(after(20));

  EXPECT_EQ(clock.shows(after(25)), 15);
  EXPECT_EQ(clock.zero(after(25)), after(10));
}

// The first result of a unit that was begun before a pause arrives during the pause.
TEST(JobClock, CountsNoTimeOfAPauseThatBeganBeforeTheFirstRay) {
  JobClock clock;
  clock.stand_still(after(0));
  clock.start(after(5));

  clock.go_on(after(20));

  EXPECT_EQ(clock.shows(after(21)), 1);
}

}  // namespace
}  // namespace ls::coordinator
