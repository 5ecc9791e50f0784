// The life of a job: folding in order, duplicate and late results, pause, cancel, extension, restart.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

using testing::ElementsAre;

std::vector<RoundIndex> rounds_folded(const std::vector<Effect>& effects) {
  std::vector<RoundIndex> rounds;
  for (const Fold& f : of<Fold>(effects)) rounds.push_back(f.unit.round);
  return rounds;
}

TEST(Job, RunsFromQueuedToDone) {
  Rig rig;
  EXPECT_TRUE(of<JobStateChanged>(rig.submit(plan_of("j", 2, 3))).empty());
  EXPECT_EQ(rig.job().state, JobState::queued);
  EXPECT_EQ(rig.job().spp, 4u) << "odd counts are rounded up";
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "no worker is connected");

  rig.join("w", 1);
  EXPECT_EQ(rig.job().state, JobState::running);
  const auto effects = rig.render_all();

  EXPECT_EQ(of<Checkpoint>(effects).size(), 2u);
  ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
  EXPECT_EQ(of<JobFinished>(effects)[0].stopped, StopReason::spp);
  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_EQ(tile_figures(rig.farm, {"j"}, 1)->spp, 4u);
}

TEST(Job, EarlyArrivalsWaitToBeFoldedInOrder) {
  Rig rig(plan_of("j", 1, 16), {{"w", 8}});
  std::vector<Rig::Held> units(rig.held[{"w"}].begin(), rig.held[{"w"}].end());
  ASSERT_EQ(units.size(), 4u);

  EXPECT_TRUE(of<Fold>(rig.result("w", units[2])).empty());
  EXPECT_TRUE(of<Fold>(rig.result("w", units[1])).empty());
  EXPECT_THAT(rounds_folded(rig.result("w", units[0])), ElementsAre(0, 1, 2));
  EXPECT_THAT(rounds_folded(rig.result("w", units[3])), ElementsAre(3));
}

TEST(Job, EqualSecondResultIsDropped) {
  Rig rig(plan_of("j", 2, 2), {{"w", 1}});
  const Rig::Held unit = rig.take("w");
  rig.result("w", unit);

  EXPECT_EQ(rig.farm.wanted(unit.key(), digest_number(1)).verdict, Wanted::Verdict::duplicate);
  EXPECT_EQ(rig.farm.wanted(unit.key(), digest_number(2)).verdict, Wanted::Verdict::other_class);
  const auto again = rig.result("w", unit);

  EXPECT_EQ(of<DropDuplicate>(again).size(), 1u);
  EXPECT_TRUE(of<RecordUnit>(again).empty());
  EXPECT_TRUE(of<Fold>(again).empty());
}

TEST(Job, DifferingSecondResultIsStoredAsEvidenceAndFailsTheJob) {
  Rig rig(plan_of("j", 5, 2), {{"a", 1}, {"b", 1}}, {.lease_prefix = "t", .audit_rate = 1});
  const Rig::Held unit = rig.take("a");
  // The unit is audited by b
  rig.result("a", unit);

  const auto effects = rig.send(UnitAccepted{unit.key(), unit.unit.samples, digest_number(666), {"b"}, 0.1});

  ASSERT_EQ(of<DigestMismatch>(effects).size(), 1u);
  const DigestMismatch found = of<DigestMismatch>(effects)[0];
  EXPECT_EQ(found.first, honest(unit.key(), unit.unit.samples));
  EXPECT_EQ(found.second, digest_number(666));
  EXPECT_EQ(found.first_worker.value + found.second_worker.value, "ab");
  EXPECT_EQ(rig.job().state, JobState::failed);
  EXPECT_THAT(of<JobFailed>(effects)[0].error, testing::HasSubstr("different bits"));
}

TEST(Job, UnrequestedResultsAreDropped) {
  Rig rig(plan_of("j", 2, 4), {{"w", 1}});
  const auto offer = [&](UnitKey key, SampleRange range) {
    return of<DropUnwanted>(rig.send(UnitAccepted{key, range, digest_number(1), {"w"}, 0.1})).size();
  };

  EXPECT_EQ(offer({{"other"}, 0, 0}, {0, 2}), 1u);
  EXPECT_EQ(offer({{"j"}, 2, 0}, {0, 2}), 1u) << "no such tile";
  EXPECT_EQ(offer({{"j"}, 0, 2}, {4, 8}), 1u) << "no such round";
  EXPECT_EQ(offer({{"j"}, 0, 0}, {0, 4}), 1u) << "another range";
  rig.join("x", 1, 2);
  EXPECT_EQ(
      of<DropUnwanted>(rig.send(UnitAccepted{{{"j"}, 0, 0}, {0, 2}, digest_number(1), {"x"}, 0.1})).size(),
      1u);
  EXPECT_EQ(rig.job().units_done, 0u);
}

TEST(Job, PauseStopsLeasesAndResumeContinues) {
  Rig rig(plan_of("j", 20, 2), {{"w", 1}});
  rig.send(JobPaused{{"j"}});
  EXPECT_EQ(rig.job().state, JobState::paused);

  rig.render_all();
  const auto done = rig.job().units_done;
  EXPECT_GT(done, 0u) << "what was leased is kept";
  EXPECT_LT(done, 20u);

  EXPECT_FALSE(sent<AssignLease>(rig.send(JobResumed{{"j"}})).empty());
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Job, PauseRecallsUnstartedUnitsAndKeepsStartedOnes) {
  Rig rig(plan_of("j", 200, 2), {{"w", 2}});
  for (int i = 0; i < 10; ++i) rig.render("w");
  ASSERT_GT(rig.worker("w").leases, 1u);

  const auto effects = rig.send(JobPaused{{"j"}});

  EXPECT_FALSE(sent<CancelLease>(effects).empty());
  EXPECT_EQ(rig.worker("w").leases, 1u);
  EXPECT_GE(rig.worker("w").units_out, 2u);
  EXPECT_EQ(rig.held[{"w"}].size(), rig.worker("w").units_out);
  EXPECT_EQ(audit(rig.farm), "");
  rig.send(JobResumed{{"j"}});
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Job, CancelRecallsLeasesAtOnce) {
  Rig rig(plan_of("j", 50, 2), {{"a", 2}, {"b", 2}});

  const auto effects = rig.send(JobCancelled{{"j"}});

  EXPECT_EQ(sent<CancelJob>(effects).size(), 2u);
  EXPECT_EQ(rig.job().state, JobState::cancelled);
  EXPECT_EQ(rig.worker("a").units_out, 0u);
  EXPECT_EQ(rig.farm.wanted({{"j"}, 0, 0}, {}).verdict, Wanted::Verdict::no);
  rig.send(JobForgotten{{"j"}});
  EXPECT_TRUE(jobs_of(rig.farm).empty());
}

TEST(Job, StopKeepsLeasedUnits) {
  Rig rig(plan_of("j", 4, 1024), {{"w", 1}});
  for (int i = 0; i < 30; ++i) rig.render("w");

  rig.send(JobStopped{{"j"}});
  const auto effects = rig.render_all();

  ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
  EXPECT_EQ(of<JobFinished>(effects)[0].stopped, StopReason::user);
  EXPECT_LT(rig.job().units_total, 4u * round_count(1024));
  EXPECT_EQ(rig.job().units_folded, rig.job().units_total);
}

TEST(Extend, FinishedJobContinuesWithItsTruncatedRoundRenderedInFull) {
  Rig rig;
  rig.join("w", 2);
  rig.submit(plan_of("j", 3, 6));  // rounds [0,2) [2,4) [4,6): the last one is truncated from [4,8)
  rig.render_all();
  ASSERT_EQ(rig.job().state, JobState::done);

  auto effects = rig.send(JobExtended{{"j"}, 16});
  ASSERT_EQ(of<ReopenRound>(effects).size(), 1u);
  EXPECT_EQ(of<ReopenRound>(effects)[0].round, 2u);
  EXPECT_EQ(rig.job().state, JobState::running);
  EXPECT_EQ(rig.farm.wanted({{"j"}, 0, 2}, digest_number(1)).samples, (SampleRange{4, 8}));
  EXPECT_EQ(
      of<DropUnwanted>(rig.send(UnitAccepted{{{"j"}, 0, 2}, {4, 6}, digest_number(1), {"w"}, 0.1})).size(),
      1u)
      << "the cut range is no longer wanted";
  effects = rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(of<Fold>(effects).size(), 6u) << "rounds [4,8) and [8,16) of three tiles";
  EXPECT_EQ(tile_figures(rig.farm, {"j"}, 0)->spp, 16u);
}

TEST(Extend, TruncatedRoundOfARunningJobIsRecalled) {
  Rig rig(plan_of("j", 3, 6), {{"w", 2}});
  while (rig.job().rounds_complete < 2) rig.render("w");
  rig.render("w");  // one unit of a truncated round is folded, others are leased
  const Rig::Held cut = rig.held[{"w"}].front();

  const auto effects = rig.send(JobExtended{{"j"}, 8});

  EXPECT_FALSE(sent<CancelLease>(effects).empty());
  EXPECT_EQ(rig.job().rounds_complete, 2u);
  EXPECT_EQ(of<DropUnwanted>(rig.result("w", cut)).size(), 1u);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(tile_figures(rig.farm, {"j"}, 2)->spp, 8u);
}

TEST(Extend, ExtendingToThePresentSamplesChangesNothing) {
  Rig rig(plan_of("j", 3, 6), {{"w", 2}});
  rig.render_all();

  EXPECT_TRUE(rig.send(JobExtended{{"j"}, 6}).empty());
  EXPECT_EQ(rig.job().state, JobState::done);
}

// Returns all data that the service would have stored for a job.
JobRestored stored(const Rig& rig, const JobPlan& plan, const std::vector<Effect>& history) {
  JobRestored restored{plan, rig.job().state, rig.job().stopped, rig.job().numeric_class, {}, {}, {}, 1.0};
  for (const RecordUnit& r : of<RecordUnit>(history)) {
    restored.accepted.push_back({r.unit.tile, r.unit.round, r.samples, r.digest, r.worker});
  }
  for (TileIndex t = 0; t < plan.grid.count(); ++t)
    restored.folded.push_back(tile_figures(rig.farm, {"j"}, t)->rounds_folded);
  return restored;
}

TEST(Restart, AcceptedResultsAreNeitherLostNorRenderedTwice) {
  const JobPlan plan = plan_of("j", 5, 40);
  Rig before;
  before.join("w", 2);
  std::vector<Effect> history = before.submit(plan);
  for (int i = 0; i < 12; ++i) {
    for (Effect& e : before.render("w")) history.push_back(e);
  }
  const JobRestored restored = stored(before, plan, history);

  Rig after;
  after.send(restored);
  EXPECT_EQ(after.job().units_done, 12u);
  after.join("w", 2);
  const auto effects = after.render_all();

  EXPECT_EQ(of<RecordUnit>(effects).size(), 5u * 6u - 12u);
  EXPECT_EQ(of<Fold>(effects).size(), 5u * 6u - before.job().units_folded);
  EXPECT_EQ(after.job().state, JobState::done);
}

TEST(Restart, AcceptedResultsAreFoldedAgainWithoutAFilm) {
  const JobPlan plan = plan_of("j", 2, 4);
  Rig before;
  before.join("w", 1);
  before.submit(plan);
  auto history = before.render_all();
  JobRestored restored = stored(before, plan, history);
  restored.state = JobState::running;
  restored.folded.clear();

  Rig after;
  const auto effects = after.send(restored);

  EXPECT_EQ(of<Fold>(effects).size(), 4u);
  EXPECT_EQ(after.job().state, JobState::done);
}

TEST(Restart, DoneJobStaysDoneAndCanBeExtended) {
  const JobPlan plan = plan_of("j", 2, 6);
  Rig before;
  before.join("w", 1);
  before.submit(plan);
  const auto history = before.render_all();

  Rig after;
  EXPECT_TRUE(of<Fold>(after.send(stored(before, plan, history))).empty());
  EXPECT_EQ(after.job().state, JobState::done);
  after.join("w", 1);
  after.send(JobExtended{{"j"}, 8});
  after.render_all();

  EXPECT_EQ(after.job().state, JobState::done);
  EXPECT_EQ(tile_figures(after.farm, {"j"}, 1)->spp, 8u);
}

TEST(Plan, RefusesTooLargeAndMeaninglessPlans) {
  EXPECT_TRUE(check_plan(plan_of("j", 4, 64)).has_value());
  EXPECT_EQ(check_plan(plan_of("j", 4, std::uint64_t{1} << 60)).error().code, Errc::invalid_argument);
  JobPlan plan = plan_of("j", 4, 64);
  plan.target_error = 0.0;
  EXPECT_EQ(check_plan(plan).error().code, Errc::invalid_argument);
  plan = plan_of("j", 0, 64);
  EXPECT_EQ(check_plan(plan).error().code, Errc::invalid_argument);
}

}  // namespace
}  // namespace ls::coordinator
