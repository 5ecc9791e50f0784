#include "worker/agent/held_work.h"

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

TEST(HeldLeases, GivesUnitsInTheOrderOfTheirLeases) {
  HeldLeases table;
  table.add(lease("a", kJob, {5, 1}), nothing_handed_in);
  table.add(lease("b", kJob, {0}), nothing_handed_in);

  EXPECT_EQ(table.take(any)->key, key(5));
  EXPECT_EQ(table.take(any)->key, key(1));
  EXPECT_EQ(table.take(any)->key, key(0));
  EXPECT_FALSE(table.take(any));
}

TEST(HeldLeases, SkipsJobsThatAreNotReady) {
  HeldLeases table;
  table.add(lease("a", kOther, {0}), nothing_handed_in);
  table.add(lease("b", kJob, {1}), nothing_handed_in);

  EXPECT_EQ(table.take([](const JobId& job) { return job == kJob; })->key, key(1));
}

TEST(HeldLeases, HoldsAUnitOnceWhenALaterLeaseNamesItAgain) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  table.take(any);

  table.add(lease("b", kJob, {0, 1}), nothing_handed_in);

  EXPECT_EQ(table.finish(key(0)), LeaseId{"b"});
  EXPECT_EQ(table.take(any)->lease, LeaseId{"b"});
  EXPECT_FALSE(table.take(any));
}

TEST(HeldLeases, LeaseEndsWhenALaterOneHasAllItsUnits) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), nothing_handed_in);

  table.add(lease("b", kJob, {0, 1}), nothing_handed_in);

  ASSERT_EQ(table.progress().size(), 1u);
  EXPECT_EQ(table.progress()[0].lease, LeaseId{"b"});
}

TEST(HeldLeases, RerendersAnUnacknowledgedUnitOnlyAfterARefusal) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), [](const UnitKey&) { return true; });

  EXPECT_FALSE(table.take(any));
  table.acknowledged(key(0), false);
  EXPECT_FALSE(table.take(any));
  table.acknowledged(key(1), true);
  EXPECT_EQ(table.take(any)->key, key(1));
}

TEST(HeldLeases, CountsDoneUnitsAndForgetsFinishedLeases) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  table.take(any);
  table.finish(key(0));

  EXPECT_THAT(table.progress(), testing::ElementsAre(WorkerProgress::Entry{LeaseId{"a"}, 1}));
  table.take(any);
  table.finish(key(1));
  EXPECT_EQ(table.lease_count(), 0U);
}

TEST(HeldLeases, DropsRunningAndWaitingUnitsOfALease) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  table.add(lease("b", kJob, {2}), nothing_handed_in);
  table.take(any);

  table.drop_lease(LeaseId{"a"});

  EXPECT_FALSE(table.finish(key(0)));
  EXPECT_EQ(table.take(any)->key, key(2));
}

TEST(HeldLeases, ReturnsWaitingUnitsAndKeepsRunningOnes) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1}), nothing_handed_in);
  table.add(lease("b", kOther, {2}), nothing_handed_in);
  table.take(any);

  EXPECT_THAT(table.return_waiting(kJob, "its disk is full"),
              testing::ElementsAre(LeaseReturned{LeaseId{"a"}, {key(1)}, "its disk is full"}));
  EXPECT_THAT(table.return_waiting(), testing::ElementsAre(LeaseReturned{LeaseId{"b"}, {{kOther, 2, 0}}}));
  EXPECT_EQ(table.finish(key(0)), LeaseId{"a"});
  EXPECT_EQ(table.lease_count(), 0U);
}

TEST(HeldLeases, ReturnsUnstartedUnitsOfOneLease) {
  HeldLeases table;
  table.add(lease("a", kJob, {0, 1, 2}), nothing_handed_in);
  table.add(lease("b", kJob, {3}), nothing_handed_in);
  table.take(any);

  EXPECT_THAT(table.return_waiting(LeaseId{"a"}),
              testing::ElementsAre(LeaseReturned{LeaseId{"a"}, {key(1), key(2)}}));
  EXPECT_TRUE(table.return_waiting(LeaseId{"a"}).empty()) << "all that is left of it is begun";
  EXPECT_TRUE(table.return_waiting(LeaseId{"unknown"}).empty());
  EXPECT_EQ(table.finish(key(0)), LeaseId{"a"});
  EXPECT_EQ(table.take(any)->key, key(3));
}

UnitResult result(TileIndex tile) {
  UnitResult r;
  r.unit = {JobId{"j"}, tile, 0};
  r.exr.resize(100);
  return r;
}
UnitFailure failure(TileIndex tile) {
  UnitFailure f;
  f.unit = {JobId{"j"}, tile, 0};
  return f;
}

TEST(Outbox, SendsEachOnceUntilTheConnectionIsLost) {
  Outbox outbox;
  outbox.add(result(0));

  EXPECT_EQ(outbox.take_unsent().size(), 1U);
  EXPECT_EQ(outbox.take_unsent().size(), 0U);
  outbox.connection_lost();
  outbox.add(result(1));
  EXPECT_THAT(outbox.take_unsent(), testing::ElementsAre(FromWorker{result(0)}, FromWorker{result(1)}));
}

TEST(Outbox, ForgetsWhatIsAcknowledgedAndItsBytes) {
  Outbox outbox;
  outbox.add(result(0));
  outbox.take_unsent();

  EXPECT_TRUE(outbox.acknowledge({JobId{"j"}, 0, 0}));
  EXPECT_FALSE(outbox.acknowledge({JobId{"j"}, 0, 0}));
  EXPECT_TRUE(outbox.empty());
  EXPECT_EQ(outbox.bytes(), 0U);
}

TEST(Outbox, AcknowledgesTheFailureBeforeTheResultOfTheSecondTry) {
  Outbox outbox;
  outbox.add(failure(0));
  outbox.take_unsent();
  outbox.add(result(0));

  outbox.acknowledge({JobId{"j"}, 0, 0});

  EXPECT_TRUE(outbox.has_result({JobId{"j"}, 0, 0}));
  EXPECT_THAT(outbox.take_unsent(), testing::ElementsAre(FromWorker{result(0)}));
}

TEST(Outbox, DropsAJobWithItsBytes) {
  Outbox outbox;
  outbox.add(result(0));
  outbox.add(failure(1));

  outbox.drop_job(JobId{"j"});

  EXPECT_EQ(outbox.bytes(), 0U);
  EXPECT_TRUE(outbox.take_unsent().empty());
}

}  // namespace
}  // namespace ls::worker
