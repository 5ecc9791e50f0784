// Which worker gets which units, when, and how many.
#include <set>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

std::vector<LeaseUnit> units_of(const std::vector<Effect>& effects, const std::string& worker) {
  std::vector<LeaseUnit> units;
  for (const auto& [id, message] : sent<AssignLease>(effects)) {
    if (id.value == worker) units.insert(units.end(), message.lease.units.begin(), message.lease.units.end());
  }
  return units;
}

TEST(Lease, EveryTileIsRenderedOnceBeforeAnyTwice) {
  Rig rig(plan_of("j", 10, 8), {{"w", 2}});

  std::vector<RoundIndex> rounds;
  while (!rig.held[{"w"}].empty()) {
    rounds.push_back(rig.held[{"w"}].front().unit.round);
    rig.render("w");
  }

  EXPECT_EQ(rounds.size(), 30u);
  EXPECT_TRUE(std::is_sorted(rounds.begin(), rounds.end()));
}

TEST(Lease, BriefIsSentOncePerStreamAndAgainAfterAReconnect) {
  Rig rig;
  rig.join("w", 1);
  auto leases = sent<AssignLease>(rig.submit(plan_of("j", 50, 8)));
  ASSERT_GE(leases.size(), 2u);
  EXPECT_TRUE(leases[0].second.brief.has_value());
  EXPECT_FALSE(leases[1].second.brief.has_value());

  rig.lose("w");
  leases = sent<AssignLease>(rig.join("w", 1));

  ASSERT_FALSE(leases.empty());
  EXPECT_EQ(leases[0].second.brief->job.value, "j");
}

TEST(Lease, FirstLeasesAreSmallUntilTheCostIsKnown) {
  Rig rig;
  rig.join("w", 4);

  for (const auto& [id, message] : sent<AssignLease>(rig.submit(plan_of("j", 10000, 64)))) {
    EXPECT_LE(message.lease.units.size(), 4u);
  }

  EXPECT_GE(rig.worker("w").units_out, 8u) << "every thread has a unit and another one waiting";
}

TEST(Lease, LaterLeasesLastAboutTheTargetTime) {
  Rig rig;
  rig.cpu_seconds = 0.1;  // the cost of a unit of 2 samples in 64 pixels
  rig.join("w", 4);
  rig.submit(plan_of("j", 10000, 2));

  const auto leases = sent<AssignLease>(rig.render_all());

  // A lease of 2 s on 4 threads, at 0.1 s a unit, has 80 units. The rest of the job is far more than that.
  std::size_t largest = 0;
  for (const auto& [id, message] : leases) largest = std::max(largest, message.lease.units.size());
  EXPECT_GE(largest, 80u);
  EXPECT_LE(largest, 81u) << "a sum of 80 rounded costs may stay a little short of 2 s";
}

TEST(Lease, CheapUnitsDoNotExceedTheLeaseLimit) {
  Rig rig;
  rig.cpu_seconds = 0;
  rig.join("w", 64);
  rig.submit(plan_of("j", 20000, 2));

  for (const auto& [id, message] : sent<AssignLease>(rig.render_all())) {
    ASSERT_LE(message.lease.units.size(), kMaxLeaseUnits);
  }
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Lease, ShrinksAtTheTail) {
  Rig rig;
  rig.cpu_seconds = 0.01;
  rig.join("a", 2);
  rig.join("b", 2);
  rig.submit(plan_of("j", 400, 4));

  std::vector<std::size_t> sizes;
  for (const auto& [id, message] : sent<AssignLease>(rig.render_all()))
    sizes.push_back(message.lease.units.size());

  EXPECT_GT(*std::max_element(sizes.begin(), sizes.end()), 50u);
  EXPECT_EQ(sizes.back(), 1u);
}

TEST(Lease, TwoLeasesWaitBehindTheRunningOne) {
  Rig rig;
  rig.cpu_seconds = 0.5;
  rig.join("w", 1);
  rig.submit(plan_of("j", 1000, 2));

  for (int i = 0; i < 20; ++i) {
    rig.render("w");
    EXPECT_GE(rig.worker("w").leases, kQueuedLeases);
  }
}

TEST(Lease, SmallWorkIsSpreadOverIdleWorkers) {
  Rig rig;
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 2);

  rig.submit(plan_of("j", 8, 2));

  for (const char* name : {"a", "b", "c", "d"}) EXPECT_EQ(rig.worker(name).units_out, 2u) << name;
}

TEST(Lease, HigherPriorityGoesFirstThenUsersWithLessTime) {
  Rig rig;
  for (const auto& [id, priority] : {std::pair{"low", 0}, {"high", 5}, {"late", 0}}) {
    JobPlan plan = plan_of(id, 3, 2);
    plan.priority = priority;
    plan.owner = id;
    rig.submit(plan);
  }

  rig.join("w", 1);
  std::vector<std::string> order;
  while (!rig.held[{"w"}].empty()) {
    order.push_back(rig.held[{"w"}].front().job.value);
    rig.render("w");
  }

  ASSERT_EQ(order.size(), 9u);
  order.resize(5);
  EXPECT_EQ(order, (std::vector<std::string>{"high", "high", "high", "low", "late"}));
}

TEST(Lease, PriorityMayChangeLater) {
  Rig rig;
  rig.submit(plan_of("first", 3, 2));
  rig.submit(plan_of("second", 3, 2));

  rig.send(JobPriority{{"second"}, 1});
  rig.join("w", 1);

  EXPECT_EQ(rig.held[{"w"}].front().job.value, "second");
}

TEST(Lease, JobIsPinnedToTheNumericClassOfItsFirstLease) {
  Rig rig;
  rig.join("a", 1, 1);
  const auto pinned = of<JobPinned>(rig.submit(plan_of("j", 100, 64)));
  ASSERT_EQ(pinned.size(), 1u);
  EXPECT_EQ(pinned[0].numeric_class, digest_number(1));
  rig.render("a");

  EXPECT_TRUE(sent<AssignLease>(rig.join("b", 1, 2)).empty());
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "") << "a may take it";
  rig.lose("a");

  EXPECT_TRUE(rig.held[{"b"}].empty());
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "b is of another numeric class, 020000000000");
}

TEST(Lease, WorkerNeedsAllTagsOfTheJob) {
  Rig rig;
  JobPlan plan = plan_of("j", 4, 2);
  plan.tags = {"vdb", "big"};
  rig.submit(plan);

  rig.join("plain", 1, 1, {"vdb"});
  EXPECT_EQ(rig.worker("plain").units_out, 0u);
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "plain lacks a tag that the job asks for");
  rig.join("right", 1, 1, {"x", "big", "vdb"});

  EXPECT_GT(rig.worker("right").units_out, 0u);
}

TEST(Lease, DrainingWorkerGetsNoMoreUnitsAndOthersGetItsRest) {
  Rig rig(plan_of("j", 3, 2), {{"a", 1}});
  rig.send(WorkerDrains{{"a"}});
  rig.render("a");
  std::vector<UnitKey> rest;
  LeaseId lease = rig.held[{"a"}].front().lease;
  std::vector<LeaseReturned> returned;
  for (const auto& h : rig.held[{"a"}]) returned.push_back({h.lease, {h.key()}});
  rig.held.clear();
  for (const LeaseReturned& r : returned) rig.send(LeaseCameBack{{"a"}, r});
  EXPECT_EQ(rig.worker("a").units_out, 0u);
  EXPECT_EQ(rig.worker("a").state, WorkerState::draining);

  rig.join("b", 1);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Lease, WorkerThatRestartsGetsNoMoreUnitsAndIsNewAfterwards) {
  Rig rig(plan_of("j", 3, 2), {{"a", 1}});
  rig.send(WorkerDrains{{"a"}});
  rig.send(WorkerDrains{{"a"}, false, true});

  EXPECT_EQ(rig.worker("a").state, WorkerState::restarting);
  rig.send(WorkerDrains{{"a"}, false, true});  // again: nothing changes
  EXPECT_EQ(rig.worker("a").state, WorkerState::restarting);
  rig.lose("a");
  rig.join("a", 1);
  EXPECT_EQ(rig.worker("a").state, WorkerState::connected);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Lease, WorkerGetsUnitsAgainWhenItsDrainIsWithdrawn) {
  Rig rig(plan_of("j", 3, 2), {{"a", 1}});
  rig.send(WorkerDrains{{"a"}});
  rig.render("a");

  rig.send(WorkerDrains{{"a"}, true});
  EXPECT_EQ(rig.worker("a").state, WorkerState::connected);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Lease, WorkerThatReturnsALeaseGetsNoneBeforeTheNextTick) {
  Rig rig(plan_of("j", 1, 2), {{"a", 1}});
  const Rig::Held unit = rig.take("a");

  EXPECT_TRUE(sent<AssignLease>(rig.send(LeaseCameBack{{"a"}, {unit.lease, {unit.key()}}})).empty());
  EXPECT_EQ(rig.job().units_queued, 1u);

  EXPECT_EQ(units_of(rig.pass(1s), "a").size(), 1u);
}

TEST(Lease, UnitsOfALostWorkerGoToOthersWithoutAPenalty) {
  Rig rig(plan_of("j", 4, 2), {{"a", 2}});
  rig.join("b", 2);

  const auto effects = rig.lose("a");
  std::set<TileIndex> tiles;
  for (const LeaseUnit& u : units_of(effects, "b")) tiles.insert(u.tile);
  std::size_t freed = 0;
  for (const auto& f : of<UnitsFreed>(effects)) freed += f.units.size();

  EXPECT_EQ(freed, 4u);
  EXPECT_EQ(tiles.size(), 4u);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Lease, EndOfAStaleStreamHasNoEffect) {
  Rig rig;
  rig.join("a", 1);  // epoch 1
  rig.join("a", 1);  // epoch 2: replaces the first
  rig.submit(plan_of("j", 4, 2));

  rig.send(WorkerLost{{"a"}, 1});

  EXPECT_EQ(rig.worker("a").state, WorkerState::connected);
  EXPECT_GT(rig.worker("a").units_out, 0u);
}

TEST(Deadline, OtherWorkersRenderExpiredUnitsAndALateResultStillCounts) {
  Rig rig(plan_of("j", 1, 2), {{"slow", 1}});
  const Rig::Held unit = rig.take("slow");
  rig.pass(kDeadlineSlack + kLoadSlack);
  EXPECT_EQ(rig.job().units_queued, 1u);
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "slow does not answer");
  rig.join("fresh", 1);
  ASSERT_EQ(rig.held[{"fresh"}].size(), 1u);

  const auto late = rig.result("slow", unit);

  EXPECT_EQ(of<RecordUnit>(late).size(), 1u);
  EXPECT_EQ(sent<CancelLease>(late).size(), 1u) << "the other copy is called off";
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Deadline, ProgressExtendsItOnlyUpToALimit) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});
  const LeaseId lease = rig.held[{"w"}].front().lease;

  Duration waited{};
  for (; rig.job().units_leased == 1 && waited < 2 * kNoGrowthLimit; waited += 1s) {
    rig.send(LeaseProgress{{"w"}, {{lease, 0}}});
    rig.pass(1s);
  }

  EXPECT_GE(waited, kNoGrowthLimit);
  EXPECT_LE(waited, kNoGrowthLimit + kDeadlineSlack + kLoadSlack + 1s);
}

TEST(Deadline, OnlyItsHolderRenewsItByTheFullName) {
  for (const bool by_another : {true, false}) {
    Rig rig(plan_of("j", 1, 2), {{"w", 1}});
    const LeaseId held = rig.held[{"w"}].front().lease;
    rig.join("other", 1);
    const LeaseId named = by_another ? held : LeaseId{held.value + "x"};

    std::size_t expired = 0;
    for (Duration waited{}; waited <= kDeadlineSlack + kLoadSlack; waited += 1s) {
      rig.send(LeaseProgress{{by_another ? "other" : "w"}, {{named, 0}}});
      for (const UnitsFreed& freed : of<UnitsFreed>(rig.pass(1s))) expired += freed.lease == held;
    }

    EXPECT_EQ(expired, 1u) << (by_another ? "by another" : "by another name");
  }
}

TEST(Deadline, IsNeverMovedForwardByProgress) {
  Rig rig(plan_of("j", 3, 2), {{"w", 1}});
  rig.render("w");
  const LeaseId lease = rig.held[{"w"}].front().lease;  // granted before the world was loaded

  rig.send(LeaseProgress{{"w"}, {{lease, 0}}});
  for (const UnitsFreed& freed : of<UnitsFreed>(rig.pass(kLoadSlack)))
    EXPECT_NE(freed.lease, lease) << "it ended before the time that it was made out with";
}

TEST(Deadline, FollowsTheMeasuredCost) {
  Rig rig;
  rig.cpu_seconds = 20;
  rig.join("w", 1);
  rig.submit(plan_of("j", 3, 2));
  rig.render("w");
  rig.cpu_seconds = 20;
  rig.join("v", 1);
  rig.submit(plan_of("k", 2, 2));

  // Leases that were granted before the cost was known have more slack. Those granted now are based on the
  // measured 20 s per unit.
  rig.send(LeaseProgress{{"w"}, {{rig.held[{"w"}].front().lease, 0}}});
  rig.pass(kDeadlineSlack + from_seconds(kDeadlineFactor * 20) - 1s);

  EXPECT_GT(rig.worker("w").units_out, 0u);
}

// Runs a job with two workers until its cost is measured, "fast" has rendered all its units, and no unit
// waits. Units of "fast" take `fast_seconds`.
void run_dry(Rig& rig, double cpu_seconds, double fast_seconds) {
  rig.cpu_seconds = cpu_seconds;
  rig.join("slow", 1);
  rig.submit(plan_of("j", 8, 2));
  rig.join("fast", 1);
  rig.render("slow");
  rig.cpu_seconds = fast_seconds;
  while (rig.worker("fast").units_out > 0 && rig.worker("slow").units_out > 1) rig.render("fast");
}

TEST(TakingBack, IdleWorkerGetsUnstartedUnitsOfOthers) {
  Rig rig;
  run_dry(rig, .5, .001);  // nothing is overdue yet: kSpeculateSlack
  EXPECT_EQ(rig.worker("slow").units_out, 1u) << "what it is rendering stays";
  while (rig.worker("fast").units_out > 0) rig.render("fast");
  EXPECT_EQ(rig.worker("slow").units_out, 1u);
  rig.render("slow");
  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.job().units_done, 8u);
}

TEST(TakingBack, WaitingWorkerIsNotifiedAndItsLateResultStillCounts) {
  Rig rig;
  rig.cpu_seconds = .5;  // nothing is overdue yet: kSpeculateSlack
  rig.join("slow", 1);
  rig.submit(plan_of("j", 4, 2));
  rig.join("fast", 1);
  rig.render("slow");
  rig.cpu_seconds = .001;
  const auto waiting = rig.held[{"slow"}];
  ASSERT_EQ(waiting.size(), 2u);
  ASSERT_EQ(rig.held[{"fast"}].size(), 1u);

  const auto moved = rig.render("fast");

  const auto told = sent<CancelLease>(moved);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].first, WorkerId{"slow"});
  EXPECT_EQ(told[0].second.lease, waiting[1].lease);
  ASSERT_EQ(rig.held[{"fast"}].size(), 1u);
  EXPECT_EQ(rig.held[{"fast"}][0].key(), waiting[1].key());

  rig.result("slow", waiting[1]);  // it had begun the unit before the lease was taken back
  EXPECT_EQ(rig.worker("fast").units_out, 0u);
  rig.render("slow");
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(TakingBack, WorkThatStartsSoonIsNotRecalled) {
  // "slow" holds three units; the last one waits for the two others.
  for (const auto& [share, stays] : {std::pair{.45, 3u}, {.55, 2u}}) {
    Rig rig;
    run_dry(rig, share * seconds(kTakeBackAfter), share * seconds(kTakeBackAfter));
    if (stays == 3) {
      EXPECT_EQ(rig.worker("fast").units_out, 0u);
      EXPECT_EQ(rig.worker("slow").units_out, 3u);
    } else {
      while (rig.worker("fast").units_out > 0) rig.render("fast");
      EXPECT_EQ(rig.worker("slow").units_out, 2u) << "the second waits for less than the limit";
    }
  }
}

TEST(TakingBack, WorkerWithoutTheJobsWorldGetsNoRecalledUnits) {
  Rig rig;
  rig.cpu_seconds = .5;  // nothing is overdue yet: kSpeculateSlack
  rig.join("slow", 1);
  rig.submit(plan_of("j", 4, 2));
  rig.render("slow");
  const auto waiting = rig.worker("slow").units_out;
  ASSERT_GT(waiting, 1u);
  rig.join("new", 1);
  rig.pass(Duration{});
  EXPECT_TRUE(rig.held[{"new"}].empty());
  EXPECT_EQ(rig.worker("slow").units_out, waiting);
}

TEST(Speculation, IdleWorkerCopiesOverdueUnitsOnce) {
  Rig rig(plan_of("j", 1, 2), {{"slow", 1}});
  rig.join("idle", 1);
  rig.join("idle2", 1);
  EXPECT_TRUE(rig.held[{"idle"}].empty()) << "not overdue yet";

  rig.pass(kSpeculateSlack);
  const std::size_t copies = rig.held[{"idle"}].size() + rig.held[{"idle2"}].size();
  EXPECT_EQ(copies, 1u);
  rig.pass(1s);
  EXPECT_EQ(rig.held[{"idle"}].size() + rig.held[{"idle2"}].size(), 1u) << "at most one extra copy";

  const auto done = rig.render(rig.held[{"idle"}].empty() ? "idle2" : "idle");
  EXPECT_EQ(sent<CancelLease>(done).size(), 1u);
  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.worker("slow").units_out, 0u);
}

}  // namespace
}  // namespace ls::coordinator
