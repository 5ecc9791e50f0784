// When jobs stop: at a target error, a time or a number of samples.
#include "tests/unit/domain/rig.h"
#include "tests/unit/domain/stop_oracle.h"
#include "tests/unit/domain/uneven_job.h"

namespace ls::coordinator {
namespace {

// The relMSE is exactly 0.64 / n: the target 0.002 needs n = 320 samples, reached with round 9.
double error_at(const UnitKey& unit) {
  return 0.64 / static_cast<double>(round_range(unit.round).s1) * 3 * 64;
}

JobPlan target_plan(int tiles) {
  JobPlan plan = plan_of("j", tiles, std::nullopt);
  plan.target_error = 0.002;
  return plan;
}

TEST(StopByError, EndsAtTheSameRoundForAnyOrderOfResults) {
  for (const int workers : {1, 2, 7}) {
    Rig rig;
    rig.rel_error = error_at;
    for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), 1 + w);
    rig.submit(target_plan(6));

    const auto effects = rig.render_all();

    ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
    EXPECT_EQ(of<JobFinished>(effects)[0].stopped, StopReason::error);
    for (TileIndex t = 0; t < 6; ++t) EXPECT_EQ(tile_figures(rig.farm, {"j"}, t)->spp, 320u);
    for (const Fold& fold : of<Fold>(effects)) EXPECT_LT(fold.samples.s0, 320u);
  }
}

TEST(StopByError, LateSpeculativeRoundsAreDropped) {
  Rig rig;
  rig.rel_error = error_at;
  rig.join("w", 32);  // its leases reach well beyond the last round that is needed
  rig.submit(target_plan(1));
  std::vector<Rig::Held> seen;
  for (int i = 0; i < 200 && rig.job().state == JobState::running; ++i) {
    for (const auto& h : rig.held[{"w"}]) {
      if (h.unit.samples.s0 >= 320) seen.push_back(h);
    }
    rig.render("w");
  }
  ASSERT_FALSE(seen.empty());

  EXPECT_EQ(of<DropUnwanted>(rig.result("w", seen[0])).size(), 1u);
  EXPECT_EQ(rig.worker("w").units_out, 0u) << "leases beyond the stop are called off";
}

TEST(StopByError, UnreachableTargetEndsAtTheSampleLimit) {
  Rig rig;
  rig.rel_error = [](const UnitKey&) { return 1e9; };
  rig.join("w", 2);
  JobPlan plan = target_plan(2);
  plan.spp = 200;
  rig.submit(plan);

  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_EQ(tile_figures(rig.farm, {"j"}, 1)->spp, 200u);
}

TEST(StopByError, ExtendingGoesBeyondTheTarget) {
  Rig rig;
  rig.rel_error = error_at;
  rig.join("w", 2);
  rig.submit(target_plan(2));
  rig.render_all();

  rig.send(JobExtended{{"j"}, 640});
  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_EQ(tile_figures(rig.farm, {"j"}, 0)->spp, 640u);
}

TEST(StopByError, RestartAnywhereEndsAtTheSameRound) {
  for (int cut = 1; cut < 40; cut += 3) {
    Rig before;
    before.rel_error = error_at;
    before.join("w", 3);
    std::vector<Effect> history = before.submit(target_plan(3));
    for (int i = 0; i < cut && !before.held[{"w"}].empty(); ++i) {
      for (Effect& e : before.render("w")) history.push_back(e);
    }
    JobRestored restored{target_plan(3), before.job().state, before.job().stopped,
                         before.job().numeric_class};
    for (const RecordUnit& r : of<RecordUnit>(history)) {
      restored.accepted.push_back({r.unit.tile, r.unit.round, r.samples, r.digest, r.worker});
    }
    for (TileIndex t = 0; t < 3; ++t) {
      restored.folded.push_back(tile_figures(before.farm, {"j"}, t)->rounds_folded);
      for (RoundIndex k = 0; k < restored.folded[t]; ++k) {
        if (restored.rel_error.size() <= k) restored.rel_error.resize(k + 1, std::vector<double>(3));
        restored.rel_error[k][t] = error_at({{"j"}, t, k});
      }
    }

    Rig after;
    after.rel_error = error_at;
    after.send(restored);
    after.join("w", 5);
    after.render_all();

    EXPECT_EQ(after.job().stopped, StopReason::error) << cut;
    for (TileIndex t = 0; t < 3; ++t) EXPECT_EQ(tile_figures(after.farm, {"j"}, t)->spp, 320u) << cut;
  }
}

TEST(StopByError, RestartAfterTheLastFoldAddsNoRound) {
  Rig before;
  before.rel_error = error_at;
  before.join("w", 3);
  before.submit(target_plan(3));
  before.render_all();
  ASSERT_EQ(before.job().stopped, StopReason::error);
  // The crash came before the state `done` was stored, so the job is restored as running.
  JobRestored restored{target_plan(3), JobState::running, std::nullopt, before.job().numeric_class};
  for (TileIndex t = 0; t < 3; ++t) {
    restored.folded.push_back(tile_figures(before.farm, {"j"}, t)->rounds_folded);
    restored.rel_error.resize(restored.folded[0], std::vector<double>(3));
    for (RoundIndex k = 0; k < restored.folded[t]; ++k) restored.rel_error[k][t] = error_at({{"j"}, t, k});
  }

  Rig after;
  after.rel_error = error_at;
  after.send(restored);
  after.join("w", 1);

  EXPECT_EQ(after.job().state, JobState::done);
  EXPECT_EQ(after.job().stopped, StopReason::error);
  EXPECT_EQ(tile_figures(after.farm, {"j"}, 0)->spp, tile_figures(before.farm, {"j"}, 0)->spp);
}

// Renders the units of worker "w" one after the other, each in `unit_seconds` of wall-clock time, with a tick
// after each.
void render_all_of_w(Rig& rig, double unit_seconds) {
  rig.own_time = true;
  for (int i = 0; i < 1000 && !rig.held[{"w"}].empty(); ++i) {
    rig.now += from_seconds(unit_seconds);
    rig.render("w");
    rig.pass(0s);
  }
}

TEST(StopByTime, LeaseEndsWithTheUnitThatReachesTheTimeLimit) {
  constexpr double kUnit = 0.05;
  Rig rig;
  rig.join("w", 1);
  rig.cpu_seconds = kUnit;
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 3;
  rig.submit(plan);
  render_all_of_w(rig, kUnit);

  EXPECT_EQ(rig.job().stopped, StopReason::time);
  // With a lease of the usual length the job would end two seconds later.
  EXPECT_GE(seconds(rig.now.time_since_epoch()), 3 - kUnit);
  EXPECT_LE(seconds(rig.now.time_since_epoch()), 3 + 3 * kUnit);
}

TEST(StopByTime, LeasedUnitsStillCountAndNoMoreAreLeased) {
  Rig rig;
  rig.own_time = true;
  rig.join("w", 1);
  rig.cpu_seconds = 0.5;
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 10;
  rig.submit(plan);
  std::size_t leased = 0, results = 0;
  std::vector<Effect> effects;
  for (int i = 0; i < 200 && !rig.held[{"w"}].empty(); ++i) {
    rig.now += 500ms;
    effects = rig.render("w");
    ++results;
    if (i % 2 == 0) {
      for (Effect& e : rig.pass(0s)) effects.push_back(std::move(e));
    }
    leased = std::max<std::size_t>(leased, results + rig.held[{"w"}].size());
  }
  rig.pass(0s);

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.job().stopped, StopReason::time);
  EXPECT_EQ(results, leased);
  EXPECT_EQ(rig.job().units_folded, leased);
  // At most one lease longer than requested.
  EXPECT_LE(seconds(rig.now.time_since_epoch()), 10 + 2 * kLeaseSeconds);
  EXPECT_GE(seconds(rig.now.time_since_epoch()), 10 - kLeaseSeconds);
}

// Each tile gets its first unit although the time is over after the first of them: an image needs a sample in
// every tile. The worker does not wait for a tick in between.
TEST(StopByTime, EveryTileGetsItsFirstRoundEvenAfterTheLimit) {
  constexpr int kTiles = 20;
  Rig rig;
  rig.own_time = true;
  rig.join("w", 1);
  rig.cpu_seconds = 2;
  JobPlan plan = plan_of("j", kTiles, std::nullopt);
  plan.time = 1;
  rig.submit(plan);
  for (int rendered = 0; rendered < kTiles; ++rendered) {
    ASSERT_FALSE(rig.held[{"w"}].empty()) << rendered << " tiles have their first round";
    rig.now += 2s;
    rig.render("w");
  }
  rig.pass(0s);

  EXPECT_EQ(rig.job().stopped, StopReason::time);
  EXPECT_EQ(rig.job().units_folded, std::uint64_t{kTiles});
}

// With one thread and units of a second, a unit that would end after the limit is begun only if at least half
// of it fits.
TEST(StopByTime, LastRoundsAreChosenByMeasuredCosts) {
  for (const double time : {20.3, 20.7}) {
    Rig rig;
    rig.join("w", 1);
    rig.cpu_seconds = 1;
    JobPlan plan = plan_of("j", 11, 4096);  // rounds 0 and 1, of 2 samples each, take 22 s
    plan.time = time;
    rig.submit(plan);
    render_all_of_w(rig, 1);

    EXPECT_EQ(rig.job().stopped, StopReason::time);
    EXPECT_EQ(rig.job().units_folded, rig.job().units_total);
    EXPECT_NEAR(seconds(rig.now.time_since_epoch()), std::round(time), 1e-9) << time;
  }
}

// The job ends by error or by time, whichever comes first. If the target is far away, the worker has work
// until the time is up, and no longer than in a job with a time limit alone.
TEST(StopByTime, UnmetTargetDoesNotChangeTheEnd) {
  constexpr double kUnit = 0.05;
  Rig rig;
  rig.own_time = true;
  rig.rel_error = uneven_error;
  rig.join("w", 1);
  rig.cpu_seconds = kUnit;
  JobPlan plan = uneven_plan(1e-9);
  plan.time = 20;
  rig.submit(plan);
  std::uint64_t units = 0;
  for (; units < 10000 && !rig.held[{"w"}].empty(); ++units) {
    rig.now += from_seconds(kUnit);
    rig.render("w");
    rig.pass(0s);
  }

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.job().stopped, StopReason::time);
  EXPECT_NEAR(seconds(rig.now.time_since_epoch()), 20, 3 * kUnit);
  EXPECT_EQ(rig.job().units_folded, units) << "nothing was rendered in vain";
}

TEST(StopByTime, TargetThatIsMetBeforeTheTimeLimitEndsTheJobUnchanged) {
  Rig rig;
  rig.own_time = true;
  rig.rel_error = uneven_error;
  rig.join("w", 1);
  rig.cpu_seconds = .01;
  JobPlan plan = uneven_plan(.01);
  plan.time = 1000;
  rig.submit(plan);
  for (int i = 0; i < 100000 && !rig.held[{"w"}].empty(); ++i) {
    rig.now += 10ms;
    rig.render("w");
    if (i % 7 == 0) rig.pass(0s);
  }

  EXPECT_EQ(rig.job().stopped, StopReason::error);
  EXPECT_EQ(ends_in(rig),
            stop_at_once(uneven_plan(.01).grid, kMaxSppWithoutLimit, .01, uneven_error_of).ends);
}

// The worker's thread gets a twelfth of a core. Costs are in CPU seconds, the limit in wall-clock seconds.
TEST(StopByTime, WorkerThatSharesItsCoresEndsInTimeToo) {
  constexpr double kCpu = .05, kWall = .6;
  Rig rig;
  rig.join("w", 1);
  rig.cpu_seconds = kCpu, rig.wait_seconds = kWall - kCpu;
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 30;
  rig.submit(plan);
  render_all_of_w(rig, kWall);

  EXPECT_EQ(rig.job().stopped, StopReason::time);
  EXPECT_NEAR(seconds(rig.now.time_since_epoch()), 30, 3 * kWall)
      << "a lease of two CPU seconds would take 24";
}

TEST(StopByTime, EveryTileGetsItsFirstRound) {
  Rig rig;
  rig.join("w", 1);
  JobPlan plan = plan_of("j", 300, std::nullopt);
  plan.time = 0.001;
  rig.submit(plan);
  rig.render("w");
  rig.pass(1s);

  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::time);
  EXPECT_GE(rig.job().rounds_complete, 1u);
}

}  // namespace
}  // namespace ls::coordinator
