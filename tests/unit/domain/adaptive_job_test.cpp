// When the tiles of a job with a target error end, each by its own errors.
#include "tests/unit/domain/stop_oracle.h"
#include "tests/unit/domain/uneven_job.h"

namespace ls::coordinator {
namespace {

TEST(Adaptive, TilesStopByTheirErrorsWhicheverWorkerRenders) {
  const auto expected = stop_at_once(uneven_plan(.01).grid, kMaxSppWithoutLimit, .01, uneven_error_of);
  ASSERT_TRUE(expected.by_error);
  ASSERT_NE(*std::min_element(expected.ends.begin(), expected.ends.end()),
            *std::max_element(expected.ends.begin(), expected.ends.end()));
  for (const int workers : {1, 3, 8}) {
    Rig rig;
    rig.rel_error = uneven_error;
    for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), 1 + 3 * w);
    rig.submit(uneven_plan(.01));

    rig.render_all();

    EXPECT_EQ(rig.job().stopped, StopReason::error);
    EXPECT_EQ(ends_in(rig), expected.ends) << workers;
  }
}

TEST(Adaptive, HalvingTheTargetOfAFinishedJobMatchesANewJobWithThatTarget) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.join("w", 4);
  rig.submit(uneven_plan(.02));
  rig.render_all();
  ASSERT_EQ(rig.job().state, JobState::done);

  rig.send(JobRetargeted{{"j"}, .01});
  EXPECT_EQ(rig.job().state, JobState::running);
  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::error);
  EXPECT_EQ(ends_in(rig),
            stop_at_once(uneven_plan(.01).grid, kMaxSppWithoutLimit, .01, uneven_error_of).ends);
}

TEST(Adaptive, AddingSamplesTurnsAFinishedJobIntoAJobBySamples) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.join("w", 4);
  rig.submit(uneven_plan(.02));
  rig.render_all();
  const auto ends = ends_in(rig);
  const std::uint64_t most = round_range(*std::max_element(ends.begin(), ends.end()) - 1).s1;
  EXPECT_FALSE(rig.farm.extended({"j"}, most - 2, rig.now));

  rig.send(JobExtended{{"j"}, most + 10});
  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_FALSE(rig.farm.plan({"j"})->target_error);
  for (TileIndex t = 0; t < 18; ++t) EXPECT_EQ(tile_figures(rig.farm, {"j"}, t)->spp, most + 10);
}

TEST(Adaptive, CheckpointsAreLevelsAndIndependentOfTheOrderOfResults) {
  std::vector<std::vector<RoundIndex>> first;
  for (const int workers : {1, 5}) {
    Rig rig;
    rig.rel_error = uneven_error;
    for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), 1 + w);
    std::vector<std::vector<RoundIndex>> seen;
    std::vector<Effect> effects = rig.submit(uneven_plan(.01));
    for (Effect& e : rig.render_all()) effects.push_back(std::move(e));
    double spp = 0;
    for (const Checkpoint& c : of<Checkpoint>(effects)) {
      EXPECT_GT(c.spp, spp);
      spp = c.spp;
      seen.push_back(c.rounds);
    }
    EXPECT_EQ(seen.back(), ends_in(rig)) << "the last one is the image as it is handed out";
    EXPECT_EQ(seen[4], std::vector<RoundIndex>(18, 5)) << "before any tile may stop, all have as many";
    EXPECT_GT(seen.size(), 10u);
    if (first.empty()) first = seen;
    EXPECT_EQ(seen, first);
  }
}

// Speculative units are leased only to threads that would idle, at most two a thread, and in the order in
// which the stop rule would request them. So only units that are out when the last level is reached, or were
// leased just before, are rendered in vain. This holds for errors that fall as 1/n; with errors that fall
// faster, as those of low-discrepancy samples do, the rule predicts too many rounds.
TEST(Adaptive, FewUnitsAreRenderedNeedlessly) {
  for (const auto [workers, threads] : {std::pair(1, 1), {1, 4}, {4, 1}, {3, 4}}) {
    Rig rig;
    rig.rel_error = [](const UnitKey& unit) {
      return 4 * uneven_error(unit) * std::pow(static_cast<double>(round_range(unit.round).s1), -.3);
    };
    for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), threads);
    std::vector<Effect> effects = rig.submit(uneven_plan(.002));
    for (Effect& e : rig.render_all()) effects.push_back(std::move(e));

    const auto rendered = of<RecordUnit>(effects).size();
    EXPECT_LE(rendered, rig.job().units_folded + 2 * static_cast<std::uint64_t>(workers * threads));
  }
}

// A job whose speculative units have to wait until the worker has little else to do keeps its turn: leases of
// other jobs in between would keep the worker busy.
TEST(Adaptive, SpeculativeUnitsKeepTheJobsTurn) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.cpu_seconds = .1;
  rig.join("w", 1);
  JobPlan plan = uneven_plan(1e-4);
  plan.grid = {{32, 32}, 32};
  plan.priority = 1;
  rig.submit(plan);
  while (rig.job().units_folded < 7) rig.render("w");  // more than the stop rule needs in any case
  ASSERT_EQ(rig.worker("w").units_out, 2u);

  rig.submit(plan_of("other", 100, 2));
  const auto others = [&] {
    const auto& held = rig.held[{"w"}];
    return std::any_of(held.begin(), held.end(), [](const Rig::Held& h) { return h.job.value == "other"; });
  };
  int kept = 0;
  for (; rig.job().state == JobState::running && !others(); ++kept) rig.render("w");
  EXPECT_GE(kept, 5) << "until nothing more was foreseen";
}

// Leases of single units must not use up kMaxLeasesPerWorker while threads still idle.
TEST(Adaptive, SpeculativeUnitsKeepAWorkerOfManyThreadsBusy) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.join("w", 200);
  rig.submit(uneven_plan(1e-4));
  std::uint32_t least = 200;
  for (int i = 0; i < 400; ++i) {
    rig.render("w");
    least = std::min(least, rig.worker("w").units_out);
  }
  ASSERT_EQ(rig.job().state, JobState::running);
  EXPECT_EQ(least, 200u);
}

}  // namespace
}  // namespace ls::coordinator
