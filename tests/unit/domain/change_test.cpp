// Changes of a running job by its user, time limits, and what workers may report.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

TEST(Failure, OnlyAWorkerThatHoldsTheUnitCanFailIt) {
  Rig rig;
  rig.join("holder", 1);
  rig.join("stranger", 1);
  JobPlan plan = plan_of("j", 1, 2);
  rig.submit(plan);
  const bool first = !rig.held[{"holder"}].empty();
  const std::string faulty = first ? "stranger" : "holder";
  const UnitKey unit{{"j"}, 0, 0};

  for (int i = 0; i < 5; ++i) {
    for (const bool scene_at_fault : {false, true})
      rig.send(UnitFailed{{faulty}, {unit, {"t-1"}, scene_at_fault, "I say so", {}, {}, {}}});
  }

  EXPECT_EQ(rig.job().state, JobState::running);
  EXPECT_EQ(rig.job().units_leased, 1u) << "its holder keeps it";
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Failure, FailureInARemovedJobStillCountsAgainstTheWorker) {
  Rig rig;
  rig.join("bad", 1);
  rig.join("good", 1);
  for (const std::string id : {"j", "k"}) {
    rig.submit(plan_of(id, 40, 2));
    for (int guard = 0; rig.job(id).state != JobState::done && guard < 1000; ++guard)
      rig.held[{"bad"}].empty() ? rig.render("good") : rig.fail("bad");
    rig.send(JobForgotten{{id}});
  }

  EXPECT_EQ(rig.worker("bad").state, WorkerState::unhealthy);
  rig.pass(kForgiveAfter);
  EXPECT_EQ(rig.worker("bad").state, WorkerState::connected);
}

TEST(Time, PausedTimeDoesNotCount) {
  Rig rig;
  rig.join("w", 1);
  JobPlan plan = plan_of("j", 4, 4096);
  plan.time = 100;
  rig.submit(plan);
  rig.render("w");
  rig.pass(10s);
  rig.send(JobPaused{{"j"}});
  while (!rig.held[{"w"}].empty()) rig.render("w");

  rig.pass(3600s);
  EXPECT_EQ(rig.job().state, JobState::paused);
  rig.send(JobResumed{{"j"}});
  rig.pass(1s);

  EXPECT_FALSE(rig.held[{"w"}].empty()) << "80 s of the budget are left";
  rig.render("w");
  rig.pass(200s);
  rig.render_all();
  EXPECT_EQ(rig.job().stopped, StopReason::time);
}

TEST(Time, StopsWhileAJobIsDone) {
  Rig rig;
  rig.join("w", 1);
  JobPlan plan = plan_of("j", 1, 4);
  plan.time = 100;
  rig.submit(plan);
  rig.render_all();
  ASSERT_EQ(rig.job().state, JobState::done);

  rig.pass(3600s);
  rig.send(JobExtended{{"j"}, 64});

  EXPECT_EQ(rig.farm.plan({"j"})->time, 100) << "hours later most of the budget is still there";
  rig.render_all();
  EXPECT_EQ(rig.job().stopped, StopReason::spp);
}

// Returns the error sum of a tile of 8 x 8 pixels with 3 channels whose relMSE after n samples is 1/n.
double one_over_n(const UnitKey& unit) { return 8 * 8 * 3 / static_cast<double>(round_range(unit.round).s1); }

std::uint64_t spp_with(double target, std::optional<double> then) {
  Rig rig;
  rig.rel_error = one_over_n;
  rig.join("w", 1);
  JobPlan plan = plan_of("j", 3, std::nullopt);
  plan.target_error = target;
  rig.submit(plan);
  for (int i = 0; i < 20; ++i) rig.render("w");
  if (then) rig.send(JobRetargeted{{"j"}, *then});
  rig.render_all();
  EXPECT_EQ(rig.job().stopped, StopReason::error);
  return tile_figures(rig.farm, {"j"}, 0)->spp;
}

TEST(Target, LoweredTargetMatchesAJobSubmittedWithThatTarget) {
  const std::uint64_t at_once = spp_with(1 / 1000.0, std::nullopt);
  EXPECT_GE(at_once, 1000u);
  EXPECT_EQ(spp_with(1 / 500.0, 1 / 1000.0), at_once);
}

TEST(Target, RaisedTargetStopsTheJobAfterTheNextRound) {
  const std::uint64_t spp = spp_with(1 / 5000.0, 1 / 64.0);
  EXPECT_GE(spp, 64u);
  EXPECT_LE(spp, 512u);
}

TEST(Target, JobWithoutATargetOrPastItRefusesANewOne) {
  Rig rig;
  rig.rel_error = one_over_n;
  rig.join("w", 1);
  rig.submit(plan_of("plain", 1, 4));
  EXPECT_THAT(rig.farm.retargeted({"plain"}, .1).error().message, HasSubstr("no target error"));
  JobPlan plan = plan_of("j", 3, std::nullopt);
  plan.target_error = 1 / 100.0;
  rig.submit(plan);
  EXPECT_EQ(rig.farm.retargeted({"j"}, -1).error().code, Errc::invalid_argument);
  EXPECT_TRUE(rig.farm.retargeted({"j"}, .1).has_value());
  rig.render_all();

  EXPECT_EQ(rig.farm.retargeted({"j"}, .02).error().code, Errc::failed_precondition)
      << "it is better already";
  rig.send(JobRetargeted{{"j"}, .02});
  EXPECT_EQ(rig.farm.plan({"j"})->target_error, 1 / 100.0);
  rig.send(JobStopped{{"j"}});
  EXPECT_TRUE(rig.farm.retargeted({"j"}, .001).has_value());
}

TEST(Target, RaisedTargetSurvivesARestart) {
  Rig before;
  before.rel_error = one_over_n;
  before.join("w", 1);
  JobPlan plan = plan_of("j", 3, std::nullopt);
  plan.target_error = 1 / 5000.0;
  std::vector<Effect> history = before.submit(plan);
  while (before.job().rounds_complete < 8 || tile_figures(before.farm, {"j"}, 0)->rounds_folded < 9)
    for (Effect& e : before.render("w")) history.push_back(e);
  plan.target_error = 1 / 64.0;  // met long ago; one tile has more rounds in the image than it needs
  JobRestored restored{plan, JobState::running, {}, digest_number(1), {}, {}, {}, 1.0};
  for (const RecordUnit& r : of<RecordUnit>(history))
    restored.accepted.push_back({r.unit.tile, r.unit.round, r.samples, r.digest, r.worker});
  for (TileIndex t = 0; t < 3; ++t)
    restored.folded.push_back(tile_figures(before.farm, {"j"}, t)->rounds_folded);
  restored.rel_error.resize(12);
  for (RoundIndex k = 0; k < 12; ++k) restored.rel_error[k].assign(3, one_over_n({{"j"}, 0, k}));

  Rig after;
  after.rel_error = one_over_n;
  after.send(restored);
  after.join("w", 1);
  after.render_all();

  EXPECT_EQ(after.job().stopped, StopReason::error);
  EXPECT_EQ(after.job().units_folded, after.job().units_total);
}

TEST(Restart, DoneJobWithoutAFilmIsFoldedAgainAndExtended) {
  const JobPlan plan = plan_of("j", 2, 6);
  Rig before;
  before.join("w", 1);
  before.submit(plan);
  JobRestored restored{plan, JobState::done, StopReason::spp, digest_number(1), {}, {0, 0}, {}, 1.0};
  for (const RecordUnit& r : of<RecordUnit>(before.render_all()))
    restored.accepted.push_back({r.unit.tile, r.unit.round, r.samples, r.digest, r.worker});

  Rig after;
  const auto effects = after.send(restored);
  EXPECT_EQ(of<Fold>(effects).size(), 6u);
  EXPECT_EQ(after.job().state, JobState::done);
  after.join("w", 1);
  after.send(JobExtended{{"j"}, 8});
  after.render_all();

  EXPECT_EQ(tile_figures(after.farm, {"j"}, 1)->spp, 8u);
}

TEST(Figures, PredictTheCostOfTheQueue) {
  Rig rig;
  rig.cpu_seconds = 1;  // the cost of a unit of 2 samples in 64 pixels
  rig.join("w", 1);
  rig.submit(plan_of("j", 10, 2));
  EXPECT_EQ(rig.job().core_seconds_queued, 0) << "nothing is measured";
  rig.render("w");

  const JobFigures f = rig.job();
  EXPECT_NEAR(f.core_seconds_left, 9, 1e-9);
  EXPECT_NEAR(f.core_seconds_queued, static_cast<double>(f.units_queued), 1e-9);
  EXPECT_LT(f.units_queued, 9u) << "the worker holds some";
  EXPECT_EQ(f.core_seconds_to_limit, f.core_seconds_left) << "no target ends it sooner";
}

// The prediction of a job's remaining time uses these figures.
TEST(Figures, CountThreadsByTheirShareOfACore) {
  Rig rig;
  rig.cpu_seconds = 1;
  rig.join("w", 4);
  rig.join("v", 4);
  rig.submit(plan_of("j", 1000, 2));
  rig.render("v");
  EXPECT_DOUBLE_EQ(rig.farm.cores_connected(), 8);

  rig.wait_seconds = 3;
  rig.render("w");

  EXPECT_DOUBLE_EQ(rig.farm.cores_connected(), 5);
  EXPECT_DOUBLE_EQ(rig.job().cores, 5);
}

// A unit is not overdue if it is slow only because its worker shares the cores: a copy would be rendered in
// vain.
TEST(Figures, WorkerThatSharesItsCoresGetsALaterDeadline) {
  for (const double wait : {0., 9.}) {
    Rig rig;
    rig.cpu_seconds = 1;
    rig.wait_seconds = wait;
    rig.join("w", 1);
    rig.submit(plan_of("j", 8, 2));
    // The leases that were granted before the cost was known are done after this
    for (int i = 0; i < 4; ++i) rig.render("w");
    while (rig.job().units_queued > 0) rig.render("w");
    rig.join("idle", 1);

    rig.pass(10s);

    EXPECT_EQ(rig.held[{"idle"}].empty(), wait > 0) << "a unit takes " << 1 + wait << " s";
  }
}

TEST(Figures, CountTheThreadsOnAJob) {
  Rig rig(plan_of("j", 1000, 2), {{"w", 4}});
  EXPECT_EQ(rig.job().cores, 4);
  rig.join("v", 2);
  EXPECT_EQ(rig.job().cores, 6);
  rig.lose("v");
  EXPECT_EQ(rig.job().cores, 4);
}

}  // namespace
}  // namespace ls::coordinator
