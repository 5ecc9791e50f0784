// Workers that get leases and render nothing: they do not remember the job, give everything back, or keep
// units without end. Nobody waits for them for ever, and a job that stands still says why.
#include <fmt/format.h>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

constexpr const char* kFull = "cannot get 'the scene': No space left on device";

// The leases of the effects that come with a brief, and those that come without.
std::pair<int, int> briefs(const std::vector<Effect>& effects) {
  std::pair<int, int> found;
  for (const auto& [id, message] : sent<AssignLease>(effects)) ++(message.brief ? found.first : found.second);
  return found;
}

TEST(Brief, IsSentAgainWithTheNextLeaseAfterAWorkerReturnsALease) {
  Rig rig(plan_of("j", 3, 2), {{"w", 1}});
  const LeaseId with_brief = rig.held[{"w"}].front().lease;
  while (rig.held[{"w"}].front().lease == with_brief) rig.render("w");
  const Rig::Held unit = rig.take("w");
  while (!rig.held[{"w"}].empty()) rig.render("w");

  rig.send(LeaseCameBack{{"w"}, {unit.lease, {unit.key()}, "", true}});

  EXPECT_EQ(rig.farm.why_waiting({"j"}), "") << "that it did not know the job does not tell against a worker";
  EXPECT_EQ(briefs(rig.pass(1s)), std::pair(1, 0));
}

TEST(Brief, WorkerThatDisownsAJobDespiteItsBriefWaitsLonger) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});
  std::vector<int> waited;

  for (int i = 0; i < 4; ++i) {
    const Rig::Held unit = rig.take("w");
    rig.send(LeaseCameBack{{"w"}, {unit.lease, {unit.key()}, "", true}});
    int ticks = 0;
    while (rig.held[{"w"}].empty() && ticks < 1000) rig.pass(1s), ++ticks;
    waited.push_back(ticks);
  }

  EXPECT_EQ(waited, (std::vector{1, 2, 4, 8}));
  EXPECT_EQ(rig.farm.why_waiting({"j"}),
            "w was given its units 4 times and rendered none: it says that it does not know the job, though "
            "the job's brief came with the units");
}

TEST(Brief, IsSentWithEachLeaseToAWorkerWithoutMemory) {
  Rig rig;
  rig.brief_bytes = 0;
  rig.join("old", 1);

  const auto [with, without] = briefs(rig.submit(plan_of("j", 50, 8)));

  EXPECT_GE(with, 2);
  EXPECT_EQ(without, 0);
}

TEST(Brief, IsSentAgainAfterOtherBriefsDisplacedIt) {
  Rig rig;
  rig.brief_bytes = 2 * memory_of(plan_of("a", 1, 2).brief);
  rig.join("w", 1);
  std::vector<Effect> effects;
  const auto render_one = [&](const char* job) {
    effects = rig.submit(plan_of(job, 1, 2));
    const auto found = briefs(effects);
    rig.render_all();
    return found;
  };
  rig.submit(plan_of("first", 40, 2));
  rig.send(JobPaused{{"first"}});
  EXPECT_EQ(render_one("second"), std::pair(1, 0));
  EXPECT_EQ(render_one("third"), std::pair(1, 0));

  EXPECT_EQ(briefs(rig.send(JobResumed{{"first"}})).first, 1);
}

TEST(Fruitless, JobSaysWhyItStandsStillIfItsOnlyWorkerReturnsAllUnits) {
  Rig rig(plan_of("j", 3, 2), {{"w", 1}});
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "");

  rig.give_back("w", kFull);
  EXPECT_EQ(rig.farm.why_waiting({"j"}),
            "w was given its units once and rendered none: cannot get 'the scene': No space left on device");
  rig.pass(1s);

  EXPECT_GT(rig.worker("w").units_out, 0u) << "it is tried again";
  EXPECT_THAT(rig.farm.why_waiting({"j"}), HasSubstr("once")) << "also while it is tried";
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done) << "its disk has room again";
}

TEST(Fruitless, WorkerWaitsLongerEachTimeItReturnsUnits) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});
  std::vector<int> waited;

  for (int i = 0; i < 9; ++i) {
    rig.give_back("w", kFull);
    int ticks = 0;
    while (rig.held[{"w"}].empty() && ticks < 1000) rig.pass(1s), ++ticks;
    waited.push_back(ticks);
  }

  EXPECT_EQ(waited, (std::vector{1, 2, 4, 8, 16, 32, 60, 60, 60}));
}

// Results that bring the farm nothing: one that it has already, one of a unit that the job does not have, and
// one of other samples than it needs.
TEST(Fruitless, UselessResultsDoNotRehabilitateAFruitlessWorker) {
  Rig rig(plan_of("j", 5, 2), {{"w", 1}});
  const Rig::Held old = rig.take("w");
  rig.result("w", old);
  std::vector<Rig::Held> useless(3, old);
  useless[1].unit.tile = 99;
  useless[2].unit.tile = 4;
  useless[2].unit.samples = {0, 64};

  for (const Rig::Held& result : useless) {
    std::vector<int> waited;
    for (int i = 0; i < 4; ++i) {
      rig.give_back("w", kFull);
      rig.result("w", result);
      int ticks = 0;
      while (rig.held[{"w"}].empty() && ticks < 1000) rig.pass(1s), ++ticks;
      waited.push_back(ticks);
    }
    EXPECT_EQ(waited, (std::vector{1, 2, 4, 8})) << result.unit.tile << " " << result.unit.samples.s1;
    rig.render("w");  // a result that counts
  }
}

TEST(Fruitless, DuplicateResultDoesNotHideLostWorkers) {
  Rig rig(plan_of("j", 3, 2), {{"v0", 1}});
  const Rig::Held old = rig.take("v0");
  rig.result("v0", old);
  for (std::uint32_t i = 0; i < kLossesInARow; ++i) {
    rig.lose(fmt::format("v{}", i));
    rig.join(fmt::format("v{}", i + 1), 1);
    rig.result(fmt::format("v{}", i + 1), old);
  }

  EXPECT_THAT(rig.farm.why_waiting({"j"}), HasSubstr("5 times in a row"));
}

TEST(Fruitless, ResultThatCouldNotBeStoredDoesNotCountAgainstItsWorker) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});

  for (int i = 0; i < 10; ++i) {
    ASSERT_FALSE(rig.held[{"w"}].empty()) << "it is offered the unit again at once";
    const Rig::Held unit = rig.take("w");
    rig.send(LeaseCameBack{{"w"}, {unit.lease, {unit.key()}}, true});
  }

  EXPECT_EQ(rig.farm.why_waiting({"j"}), "");
}

TEST(Fruitless, OthersGetTheUnitsAtOnce) {
  Rig rig(plan_of("j", 4, 2), {{"broken", 1}});
  rig.join("healthy", 1);

  rig.give_back("broken", kFull);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
}

// A job of two units that "healthy" has rendered, both audited by "broken" alone.
struct Audited {
  explicit Audited(
      Farm::Options options = {.lease_prefix = "t", .limits = {}, .audit_rate = 1, .audit_seed = 7})
      : rig(std::move(options)) {
    rig.join("healthy", 1);
    rig.join("broken", 1);
    rig.submit(plan_of("j", 2, 2));
    rig.give_back("broken", kFull);
    rig.pass(1s);
    while (!rig.held[{"healthy"}].empty()) rig.render("healthy");
  }
  Rig rig;
};

TEST(Fruitless, AuditIsDroppedIfItsOnlyWorkerKeepsReturningIt) {
  Audited audited;
  Rig& rig = audited.rig;
  ASSERT_EQ(rig.job().units_done, 2u);
  ASSERT_EQ(rig.job().state, JobState::running);

  int seconds = 0;
  for (; rig.job().state == JobState::running && seconds < 600; ++seconds) {
    rig.give_back("broken", kFull);
    rig.pass(1s);
  }

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_LE(seconds, 10);
  EXPECT_EQ(rig.farm.audits().dropped, 2u);
}

TEST(Fruitless, NextJobBeginsNoAuditsThatOnlyAFruitlessWorkerCouldRender) {
  Audited audited;
  Rig& rig = audited.rig;
  for (int i = 0; i < 20; ++i) rig.give_back("broken", kFull), rig.pass(1s);
  ASSERT_EQ(rig.job().state, JobState::done);
  const std::uint64_t before = rig.farm.audits().asked;

  rig.submit(plan_of("next", 4, 2));
  for (int i = 0; i < 20; ++i) {
    rig.give_back("broken", kFull);
    rig.pass(1s);
    while (!rig.held[{"healthy"}].empty()) rig.render("healthy");
  }

  EXPECT_EQ(rig.job("next").state, JobState::done);
  EXPECT_EQ(rig.farm.audits().asked, before);
}

TEST(Fruitless, WorkerIsNoLongerFruitlessAfterAResult) {
  Audited audited;
  Rig& rig = audited.rig;
  for (int i = 0; i < 20; ++i) rig.give_back("broken", kFull), rig.pass(1s);
  rig.submit(plan_of("next", 40, 2));
  rig.render("broken");

  rig.render_all();

  EXPECT_GT(rig.farm.audits().equal, 0u);
}

// Each process takes the audit and is gone; the next one has another name.
TEST(Fruitless, AuditIsDroppedAfterItLostManyWorkers) {
  Rig rig(plan_of("j", 1, 2), {{"healthy", 1}},
          {.lease_prefix = "t", .limits = {}, .audit_rate = 1, .audit_seed = 7});
  rig.join("v0", 1);
  rig.render("healthy");
  ASSERT_EQ(rig.job().state, JobState::running);

  int lost = 0;
  for (; rig.job().state == JobState::running && lost < 100; ++lost) {
    rig.lose(fmt::format("v{}", lost));
    rig.join(fmt::format("v{}", lost + 1), 1);
    rig.pass(1s);
  }

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(lost, static_cast<int>(kAuditLeases));
}

TEST(Fruitless, JobReportsThatItLosesOneWorkerAfterAnother) {
  Rig rig(plan_of("j", 3, 2), {{"v0", 1}});

  for (std::uint32_t i = 0; i < kLossesInARow; ++i) {
    EXPECT_EQ(rig.farm.why_waiting({"j"}), "");
    rig.lose(fmt::format("v{}", i));
    rig.join(fmt::format("v{}", i + 1), 1);
  }

  EXPECT_EQ(rig.farm.why_waiting({"j"}),
            "5 times in a row the worker that held its units was lost before it finished one; the last: v4");
  rig.render("v5");
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "");
}

TEST(Fruitless, WorkerThatRendersOnlyOtherJobsLosesTheUnitsOfThisJob) {
  Rig rig(plan_of("j", 1, 2), {{"w", 1}});
  const LeaseId forgotten = rig.held[{"w"}].front().lease;
  rig.take("w");
  rig.submit(plan_of("busy", 2000, 2));

  Duration waited{};
  for (; rig.job("j").units_leased == 1 && waited < 3 * kNoGrowthLimit; waited += 10s) {
    LeaseProgress progress{{"w"}, {{forgotten, 0}}};
    for (const auto& unit : rig.held[{"w"}]) progress.leases.push_back({unit.lease, 0});
    rig.send(progress);
    rig.render("w");
    rig.pass(10s);
  }

  EXPECT_LT(waited, 2 * kNoGrowthLimit);
}

TEST(Fruitless, FruitlessWorkerPinsNoNewJobToItsClass) {
  Rig rig;
  rig.join("broken", 1, 2);
  rig.submit(plan_of("first", 1, 2));
  for (std::uint32_t i = 0; i < kFruitlessLeases; ++i) {
    rig.give_back("broken", kFull);
    rig.pass(kFruitlessPauseMost);
  }
  rig.give_back("broken", kFull);
  rig.join("healthy", 1, 1);
  rig.lose("healthy");
  rig.join("healthy", 1, 1);

  rig.submit(plan_of("second", 4, 2));
  rig.pass(kFruitlessPauseMost);
  rig.render_all();

  EXPECT_EQ(rig.job("second").numeric_class, digest_number(1));
  EXPECT_EQ(rig.job("second").state, JobState::done);
}

}  // namespace
}  // namespace ls::coordinator
