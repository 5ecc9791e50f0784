// Each cause for which units are freed (metric lightshaft_units_freed_total) does occur.
#include <cmath>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

struct Story {
  FreedCause cause;
  std::function<std::vector<Effect>(Rig&)> tell;  // provokes the cause and returns the effects
};

// Adds a worker that holds units of a job.
void lend(Rig& rig, int threads = 2) {
  rig.join("w", threads);
  rig.submit(plan_of("j", 8, 6));
}

std::vector<Effect> move_to_an_idle_worker(Rig& rig) {
  rig.cpu_seconds = 1;
  rig.join("slow", 1);
  rig.submit(plan_of("j", 4, 2));
  rig.join("fast", 1);
  rig.render("slow");
  return rig.render("fast");
}

std::vector<Effect> extend_while_its_cut_round_is_out(Rig& rig) {
  lend(rig);
  while (rig.job().rounds_complete < 2) rig.render("w");
  return rig.send(JobExtended{{"j"}, 8});
}

std::vector<Effect> stop_by_error_with_rounds_ahead(Rig& rig) {
  rig.rel_error = [](const UnitKey& unit) { return std::exp2(-static_cast<double>(unit.round)); };
  rig.join("w", 32);
  JobPlan plan = plan_of("j", 8, std::nullopt);
  plan.target_error = .1;
  rig.submit(plan);
  std::vector<Effect> all;
  while (rig.job().state == JobState::running)
    for (Effect& e : rig.render("w")) all.push_back(std::move(e));
  return all;
}

const Story kStories[] = {
    {FreedCause::worker_lost,
     [](Rig& rig) {
       lend(rig);
       return rig.lose("w");
     }},
    {FreedCause::newer_stream,
     [](Rig& rig) {
       lend(rig);
       return rig.join("w", 2);
     }},
    {FreedCause::deadline_passed,
     [](Rig& rig) {
       lend(rig);
       return rig.pass(std::chrono::hours(1));
     }},
    {FreedCause::returned,
     [](Rig& rig) {
       lend(rig);
       const Rig::Held unit = rig.take("w");
       return rig.send(LeaseCameBack{{"w"}, {unit.lease, {unit.key()}}});
     }},
    {FreedCause::recalled,
     [](Rig& rig) {
       lend(rig);
       const Rig::Held unit = rig.held[{"w"}].back();
       rig.send(JobStopped{{"j"}});
       return rig.send(LeaseCameBack{{"w"}, {unit.lease, {unit.key()}}});
     }},
    {FreedCause::failed,
     [](Rig& rig) {
       lend(rig);
       return rig.fail("w");
     }},
    {FreedCause::moved, move_to_an_idle_worker},
    {FreedCause::paused,
     [](Rig& rig) {
       lend(rig, 1);
       return rig.send(JobPaused{{"j"}});
     }},
    {FreedCause::round_reopened, extend_while_its_cut_round_is_out},
    {FreedCause::worker_quarantined,
     [](Rig& rig) {
       lend(rig);
       return rig.send(WorkerQuarantined{{"w"}, "found elsewhere"});
     }},
    {FreedCause::not_wanted, stop_by_error_with_rounds_ahead},
    {FreedCause::job_ended,
     [](Rig& rig) {
       lend(rig);
       return rig.send(JobCancelled{{"j"}});
     }},
};

TEST(Freed, FreedUnitsHaveACause) {
  for (const Story& story : kStories) {
    Rig rig;
    const auto freed = of<UnitsFreed>(story.tell(rig));

    EXPECT_TRUE(std::any_of(freed.begin(), freed.end(), [&](const UnitsFreed& f) {
      return f.cause == story.cause && !f.units.empty();
    })) << to_string(story.cause);
  }
}

TEST(Freed, EveryCauseIsCountedInAScenario) {
  for (const auto& [cause, word] : kFreedCauses)
    EXPECT_TRUE(std::any_of(std::begin(kStories), std::end(kStories), [&](const Story& story) {
      return story.cause == cause;
    })) << word;
}

}  // namespace
}  // namespace ls::coordinator
