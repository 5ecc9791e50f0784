// What a worker remembers, as both ends of a stream compute it.
#include "util/protocol/briefs.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace ls {
namespace {

TEST(BriefMemory, KeepsTheMostRecentlyLeasedJobsThatFit) {
  BriefMemory<int> memory(10);
  memory.leased(1, 4);
  memory.leased(2, 4);
  memory.leased(1, std::nullopt);

  memory.leased(3, 4);

  EXPECT_TRUE(memory.has(1));
  EXPECT_FALSE(memory.has(2));
  EXPECT_TRUE(memory.has(3));
}

TEST(BriefMemory, TooLargeBriefIsForgottenAtOnce) {
  BriefMemory<int> memory(10);
  memory.leased(1, 4);

  memory.leased(2, 11);

  EXPECT_EQ(memory.size(), 0u);
}

TEST(BriefMemory, UncertainEntryKeepsItsPlaceUntilItsBriefIsSentAgain) {
  BriefMemory<int> memory(10);
  memory.leased(1, 6);
  memory.doubt(1);

  EXPECT_FALSE(memory.has(1));
  EXPECT_EQ(memory.size(), 1u);
  memory.leased(1, 6);
  memory.leased(2, 4);

  EXPECT_TRUE(memory.has(1));
  EXPECT_TRUE(memory.has(2));
}

// A coordinator may count on a smaller memory than the worker has, and may take briefs for larger.
TEST(BriefMemory, WorkerRemembersWhatTheCoordinatorExpectsForAnyLeases) {
  std::mt19937 random(1);
  for (const std::size_t counted_on : {50u, 200u, 400u}) {
    BriefMemory<int> coordinator(counted_on), worker(400);
    int known = 0;
    for (int i = 0; i < 20000; ++i) {
      const int job = static_cast<int>(random() % 60);
      const std::size_t bytes = 1 + static_cast<std::size_t>(job) % 17;
      const bool brief = !coordinator.has(job);
      known += !brief;
      ASSERT_TRUE(brief || worker.has(job)) << i;
      coordinator.leased(job, brief ? std::optional(bytes + random() % 3) : std::nullopt);
      worker.leased(job, brief ? std::optional(bytes) : std::nullopt);
      if (random() % 50 == 0) coordinator.doubt(job);
    }
    EXPECT_GT(known, 1000);
  }
}

}  // namespace
}  // namespace ls
