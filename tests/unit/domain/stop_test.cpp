// When jobs stop: by error, by time, by samples.
#include "coordinator/domain/stop_rule.h"
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

TEST(StopRule, PredictsFromEarlierRoundsAndNeverBelowSixtyFourSamples) {
  // Round 5 ends at 64 samples, round 4 at 32.
  EXPECT_DOUBLE_EQ(predicted_relmse(0.02, 32, 64), 0.01);
  EXPECT_TRUE(stop_after(5, 0.02, 0.01, 1024));
  EXPECT_FALSE(stop_after(5, 0.0201, 0.01, 1024));
  EXPECT_FALSE(stop_after(4, 0.0, 0.01, 1024)) << "32 samples are too few to judge";
  EXPECT_FALSE(stop_after(5, std::numeric_limits<double>::quiet_NaN(), 0.01, 1024));
}

TEST(StopRule, FoldsNoRoundBeforeItIsSurelyWanted) {
  EXPECT_EQ(fold_limit(0), 5u);
  EXPECT_EQ(fold_limit(4), 5u) << "rounds 0..3 are complete: round 5 may be the last";
  EXPECT_EQ(fold_limit(5), 6u) << "round 5 was not declared the last one, so 6 is wanted";
  EXPECT_EQ(fold_limit(9), 10u);
}

// relMSE of exactly 0.64 / n: the target 0.002 needs n = 320 samples, round 9.
double error_at(const UnitKey& unit) {
  return 0.64 / static_cast<double>(round_range(unit.round).s1) * 3 * 64;
}

JobPlan target_plan(int tiles) {
  JobPlan plan = plan_of("j", tiles, std::nullopt);
  plan.target_error = 0.002;
  return plan;
}

TEST(StopByError, EndsAtTheSameRoundWhateverTheOrder) {
  for (const int workers : {1, 2, 7}) {
    Rig rig;
    rig.rel_error = error_at;
    for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), 1 + w);
    rig.submit(target_plan(6));

    const auto effects = rig.render_all();

    ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
    EXPECT_EQ(of<JobFinished>(effects)[0].stopped, StopReason::error);
    for (TileIndex t = 0; t < 6; ++t) EXPECT_EQ(rig.farm.tile({"j"}, t)->spp, 320u);
    for (const Fold& fold : of<Fold>(effects)) EXPECT_LT(fold.samples.s0, 320u);
  }
}

TEST(StopByError, LateSpeculativeRoundsAreDropped) {
  Rig rig;
  rig.rel_error = error_at;
  rig.join("w", 32);  // leases rounds well beyond the stop
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

TEST(StopByError, AnUnreachableTargetEndsAtTheSampleLimit) {
  Rig rig;
  rig.rel_error = [](const UnitKey&) { return 1e9; };
  rig.join("w", 2);
  JobPlan plan = target_plan(2);
  plan.spp = 200;
  rig.submit(plan);

  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_EQ(rig.farm.tile({"j"}, 1)->spp, 200u);
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
  EXPECT_EQ(rig.farm.tile({"j"}, 0)->spp, 640u);
}

TEST(StopByError, ARestartAnywhereEndsAtTheSameRound) {
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
      restored.folded.push_back(before.farm.tile({"j"}, t)->rounds_folded);
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
    for (TileIndex t = 0; t < 3; ++t) EXPECT_EQ(after.farm.tile({"j"}, t)->spp, 320u) << cut;
  }
}

TEST(StopByError, ARestartAfterTheLastFoldAddsNoRound) {
  Rig before;
  before.rel_error = error_at;
  before.join("w", 3);
  before.submit(target_plan(3));
  before.render_all();
  ASSERT_EQ(before.job().stopped, StopReason::error);
  // The crash came before `done` was stored: it runs, as far as anyone knows.
  JobRestored restored{target_plan(3), JobState::running, std::nullopt, before.job().numeric_class};
  for (TileIndex t = 0; t < 3; ++t) {
    restored.folded.push_back(before.farm.tile({"j"}, t)->rounds_folded);
    restored.rel_error.resize(restored.folded[0], std::vector<double>(3));
    for (RoundIndex k = 0; k < restored.folded[t]; ++k) restored.rel_error[k][t] = error_at({{"j"}, t, k});
  }

  Rig after;
  after.rel_error = error_at;
  after.send(restored);
  after.join("w", 1);

  EXPECT_EQ(after.job().state, JobState::done);
  EXPECT_EQ(after.job().stopped, StopReason::error);
  EXPECT_EQ(after.farm.tile({"j"}, 0)->spp, before.farm.tile({"j"}, 0)->spp);
}

TEST(StopByTime, ALeaseEndsWithTheUnitThatReachesTheTime) {
  constexpr double kUnit = 0.05;
  Rig rig;
  rig.join("w", 1);
  rig.cpu_seconds = kUnit;
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 3;
  rig.submit(plan);
  for (int i = 0; i < 1000 && !rig.held[{"w"}].empty(); ++i) {
    rig.now += from_seconds(kUnit);
    rig.render("w");
    rig.pass(0s);
  }

  EXPECT_EQ(rig.job().stopped, StopReason::time);
  // A lease of the usual length would end two seconds later.
  EXPECT_GE(seconds(rig.now.time_since_epoch()), 3 - kUnit);
  EXPECT_LE(seconds(rig.now.time_since_epoch()), 3 + 3 * kUnit);
}

TEST(StopByTime, NothingLeasedIsThrownAwayAndNothingIsLeasedAfterwards) {
  Rig rig;
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
  // At most one lease longer than asked.
  EXPECT_LE(seconds(rig.now.time_since_epoch()), 10 + 2 * kLeaseSeconds);
  EXPECT_GE(seconds(rig.now.time_since_epoch()), 10 - kLeaseSeconds);
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
