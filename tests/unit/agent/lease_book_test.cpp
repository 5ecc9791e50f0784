#include "worker/agent/lease_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ls::worker {
namespace {

const JobId kJob{"j-1"}, kOther{"j-2"};

Lease lease(const char* id, const JobId& job, std::vector<TileIndex> tiles) {
  Lease l{LeaseId{id}, job, {}};
  for (const TileIndex t : tiles) l.units.push_back({t, 0, {0, 0, 8, 8}, {0, 2}});
  return l;
}
UnitKey key(TileIndex tile) { return {kJob, tile, 0}; }
bool nothing_handed_in(const UnitKey&) { return false; }
bool any(const JobId&) { return true; }

TEST(LeaseBook, GivesUnitsInTheOrderOfTheirLeases) {
  LeaseBook book;
  book.add(lease("a", kJob, {5, 1}), nothing_handed_in);
  book.add(lease("b", kJob, {0}), nothing_handed_in);

  EXPECT_EQ(book.take(any)->key, key(5));
  EXPECT_EQ(book.take(any)->key, key(1));
  EXPECT_EQ(book.take(any)->key, key(0));
  EXPECT_FALSE(book.take(any));
}

TEST(LeaseBook, SkipsJobsThatAreNotReady) {
  LeaseBook book;
  book.add(lease("a", kOther, {0}), nothing_handed_in);
  book.add(lease("b", kJob, {1}), nothing_handed_in);

  EXPECT_EQ(book.take([](const JobId& job) { return job == kJob; })->key, key(1));
}

TEST(LeaseBook, HoldsAUnitOnceWhenALaterLeaseNamesItAgain) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  book.take(any);

  book.add(lease("b", kJob, {0, 1}), nothing_handed_in);

  EXPECT_EQ(book.finish(key(0)), LeaseId{"b"});
  EXPECT_EQ(book.take(any)->lease, LeaseId{"b"});
  EXPECT_FALSE(book.take(any));
}

TEST(LeaseBook, ALeaseEndsWhenALaterOneHasTakenAllItsUnits) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), nothing_handed_in);

  book.add(lease("b", kJob, {0, 1}), nothing_handed_in);

  ASSERT_EQ(book.progress().size(), 1u);
  EXPECT_EQ(book.progress()[0].lease, LeaseId{"b"});
}

TEST(LeaseBook, DoesNotRenderAgainWhatWaitsForItsAcknowledgementUnlessThatIsARefusal) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), [](const UnitKey&) { return true; });

  EXPECT_FALSE(book.take(any));
  book.acknowledged(key(0), false);
  EXPECT_FALSE(book.take(any));
  book.acknowledged(key(1), true);
  EXPECT_EQ(book.take(any)->key, key(1));
}

TEST(LeaseBook, CountsDoneUnitsAndForgetsFinishedLeases) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  book.take(any);
  book.finish(key(0));

  EXPECT_THAT(book.progress(), testing::ElementsAre(WorkerProgress::Entry{LeaseId{"a"}, 1}));
  book.take(any);
  book.finish(key(1));
  EXPECT_EQ(book.lease_count(), 0U);
}

TEST(LeaseBook, DropsRunningAndWaitingUnitsOfALease) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  book.add(lease("b", kJob, {2}), nothing_handed_in);
  book.take(any);

  book.drop_lease(LeaseId{"a"});

  EXPECT_FALSE(book.finish(key(0)));
  EXPECT_EQ(book.take(any)->key, key(2));
}

TEST(LeaseBook, ReturnsWhatWaitsAndKeepsWhatRuns) {
  LeaseBook book;
  book.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  book.add(lease("b", kOther, {2}), nothing_handed_in);
  book.take(any);

  EXPECT_THAT(book.return_waiting(&kJob), testing::ElementsAre(LeaseReturned{LeaseId{"a"}, {key(1)}}));
  EXPECT_THAT(book.return_waiting(), testing::ElementsAre(LeaseReturned{LeaseId{"b"}, {{kOther, 2, 0}}}));
  EXPECT_EQ(book.finish(key(0)), LeaseId{"a"});
  EXPECT_EQ(book.lease_count(), 0U);
}

}  // namespace
}  // namespace ls::worker
