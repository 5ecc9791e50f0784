// Jobs whose target error is that of their denoised layers: which checks the farm requests, and when such a
// job ends.
#include "tests/unit/domain/uneven_job.h"

namespace ls::coordinator {
namespace {

constexpr double kTarget = .005;

JobPlan denoised_plan(double target) {
  JobPlan plan = uneven_plan(target);
  plan.target_denoised = true;
  return plan;
}

double folded_spp(const Rig& rig) {
  double sum = 0;
  for (TileIndex t = 0; t < 18; ++t) sum += static_cast<double>(tile_figures(rig.farm, {"j"}, t)->spp);
  return sum / 18;
}

double upper_end_at(const CheckDenoised& check) { return 1 / check.spp; }

// Renders the job with a farm in which each check is answered immediately. Checks that the film is then
// exactly that of the level.
std::vector<RoundIndex> ends_at(double target, int workers) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.denoised = [&](const CheckDenoised& check) {
    EXPECT_EQ(folded_spp(rig), check.spp);
    return upper_end_at(check);
  };
  for (int w = 0; w < workers; ++w) rig.join("w" + std::to_string(w), 1 + 3 * w);
  rig.submit(denoised_plan(target));
  rig.render_all();
  EXPECT_EQ(rig.job().stopped, StopReason::error);
  EXPECT_LE(1 / folded_spp(rig), target);
  return ends_in(rig);
}

TEST(DenoisedJob, EndsAtTheSameLevelForAnyWorkers) {
  const auto expected = ends_at(kTarget, 1);
  EXPECT_NE(*std::min_element(expected.begin(), expected.end()),
            *std::max_element(expected.begin(), expected.end()));
  for (const int workers : {3, 8}) EXPECT_EQ(ends_at(kTarget, workers), expected) << workers;
}

TEST(DenoisedJob, JobWithoutNoiseEndsAtTheFirstCheck) {
  Rig rig;
  rig.rel_error = [](const UnitKey&) { return 0.; };
  int checks = 0;
  rig.denoised = [&](const CheckDenoised&) { return ++checks, 0.; };
  rig.join("w", 4);
  rig.submit(denoised_plan(kTarget));
  rig.render_all();

  EXPECT_EQ(rig.job().stopped, StopReason::error);
  EXPECT_EQ(folded_spp(rig), 64);
  EXPECT_EQ(checks, 1);
}

TEST(DenoisedJob, FoldsNothingMoreBeforeTheCheckIsAnswered) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.join("w", 4);
  rig.submit(denoised_plan(kTarget));
  std::vector<CheckDenoised> asked;
  while (asked.empty()) asked = of<CheckDenoised>(rig.render("w"));
  ASSERT_EQ(asked.size(), 1u);
  const auto folded = rig.job().units_folded;

  while (!rig.held[{"w"}].empty()) EXPECT_TRUE(of<CheckDenoised>(rig.render("w")).empty());
  EXPECT_EQ(rig.job().units_folded, folded);
  rig.send(DenoisedChecked{{"j"}, {asked[0].spp, 0, upper_end_at(asked[0])}});
  rig.denoised = upper_end_at;
  rig.render_all();

  EXPECT_EQ(ends_in(rig), ends_at(kTarget, 1));
}

TEST(DenoisedJob, LoweredTargetMatchesANewJobWithIt) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.denoised = upper_end_at;
  rig.join("w", 4);
  rig.submit(denoised_plan(2 * kTarget));
  rig.render_all();
  ASSERT_EQ(rig.job().state, JobState::done);
  EXPECT_NE(ends_in(rig), ends_at(kTarget, 1));

  rig.send(JobRetargeted{{"j"}, kTarget});
  rig.render_all();

  EXPECT_EQ(ends_in(rig), ends_at(kTarget, 1));
}

TEST(DenoisedJob, ResumedJobRepeatsItsPendingCheck) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.join("w", 4);
  rig.submit(denoised_plan(kTarget));
  std::vector<CheckDenoised> asked;
  while (asked.empty()) asked = of<CheckDenoised>(rig.render("w"));
  rig.send(JobPaused{{"j"}});
  rig.denoised = upper_end_at;

  const auto again = of<CheckDenoised>(rig.send(JobResumed{{"j"}}));

  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].spp, asked[0].spp);
  rig.render_all();
  EXPECT_EQ(ends_in(rig), ends_at(kTarget, 1));
}

// The coordinator may be killed at any moment. It then restores the folded rounds and the stored checks.
TEST(DenoisedJob, RestoredJobEndsAtTheSamePoint) {
  const auto expected = ends_at(kTarget, 1);
  for (const int units : {10, 80, 100, 120, 140, 160, 200}) {
    Rig first;
    std::vector<DenoisedCheck> stored;
    first.rel_error = uneven_error;
    first.denoised = [&](const CheckDenoised& check) {
      stored.push_back({check.spp, 0, upper_end_at(check)});
      return upper_end_at(check);
    };
    first.join("w", 4);
    first.submit(denoised_plan(kTarget));
    for (int i = 0; i < units && first.job().state != JobState::done; ++i) first.render("w");

    JobRestored event;
    event.plan = denoised_plan(kTarget);
    event.state = first.job().state;
    event.stopped = first.job().stopped;
    event.numeric_class = digest_number(1);
    event.folded = ends_in(first);
    event.denoised_checks = stored;
    const RoundIndex rounds = *std::max_element(event.folded.begin(), event.folded.end());
    for (RoundIndex k = 0; k < rounds; ++k) {
      event.rel_error.emplace_back();
      for (TileIndex t = 0; t < 18; ++t) event.rel_error.back().push_back(uneven_error_of(t, k));
    }
    Rig second;
    second.rel_error = uneven_error;
    second.denoised = [&](const CheckDenoised& check) {
      for (const DenoisedCheck& c : stored) EXPECT_NE(c.spp, check.spp) << "this is known";
      EXPECT_EQ(folded_spp(second), check.spp);
      return upper_end_at(check);
    };
    second.send(event);
    second.join("w", 4);
    second.render_all();
    EXPECT_EQ(ends_in(second), expected) << units;
  }
}

TEST(DenoisedJob, EndsWithItsSamplesIfTheTargetIsNotReached) {
  Rig rig;
  rig.rel_error = uneven_error;
  rig.denoised = [](const CheckDenoised&) { return 1.; };
  rig.join("w", 4);
  JobPlan plan = denoised_plan(kTarget);
  plan.spp = 200;
  rig.submit(plan);
  rig.render_all();
  EXPECT_EQ(rig.job().stopped, StopReason::spp);
  EXPECT_EQ(folded_spp(rig), 200);
}

}  // namespace
}  // namespace ls::coordinator
