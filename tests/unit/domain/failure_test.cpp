// Three kinds of failures are counted separately: lost workers or leases, units that fail, workers that fail.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

TEST(Failure, UnitThatFailsOnThreeWorkersFailsTheJobWithPlaceAndReplayCommand) {
  Rig rig;
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 1);
  rig.submit(plan_of("j", 1, 2));

  std::vector<Effect> effects;
  int attempts = 0;
  std::set<std::string> tried;
  while (rig.job().state == JobState::running) {
    for (auto& [id, units] : rig.held) {
      if (units.empty()) continue;
      tried.insert(id.value);
      effects = rig.fail(id.value);
      ++attempts;
      break;
    }
    ASSERT_LT(attempts, 10);
  }

  EXPECT_EQ(attempts, 3);
  EXPECT_EQ(tried.size(), 3u) << "every time on another worker";
  ASSERT_EQ(of<JobFailed>(effects).size(), 1u);
  EXPECT_THAT(of<JobFailed>(effects)[0].error,
              testing::AllOf(testing::HasSubstr("tile 0"), testing::HasSubstr("signal 11"),
                             testing::HasSubstr("lightshaft render SCENE --pixel 3,4 --sample 5")));
  const std::optional<JobFailure> failure = of<JobFailed>(effects)[0].failure;
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->kind, FailureKind::unit);
  EXPECT_EQ(failure->attempts.size(), 3u);
  EXPECT_EQ(failure->attempts[2].signal, 11);
  EXPECT_EQ(failure->replay, "lightshaft render SCENE --pixel 3,4 --sample 5");
  EXPECT_EQ(describe(*failure), of<JobFailed>(effects)[0].error);
}

TEST(Failure, LoneWorkerGetsASecondAttempt) {
  Rig rig(plan_of("j", 1, 2), {{"a", 1}});

  rig.fail("a");
  EXPECT_EQ(rig.job().state, JobState::running);
  rig.fail("a");

  EXPECT_EQ(rig.job().state, JobState::failed);
}

TEST(Failure, OneWorkersReportOfAFaultySceneDoesNotFailTheJob) {
  Rig rig(plan_of("j", 5, 2), {{"a", 1}, {"b", 1}});

  while (!rig.held[{"a"}].empty()) rig.fail("a", true);
  EXPECT_EQ(rig.job().state, JobState::running);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Failure, SceneFailsOnlyAfterAsManyReportsAsAnyUnit) {
  for (const int workers : {1, 2, 3, 4}) {
    Rig rig;
    for (int i = 0; i < workers; ++i) rig.join("w" + std::to_string(i), 1);
    rig.submit(plan_of("bad", 1, 2));
    std::set<std::string> found;
    std::vector<Effect> effects;
    int attempts = 0;
    for (; rig.job("bad").state == JobState::running && attempts < 10; ++attempts)
      for (auto& [id, units] : rig.held)
        if (!units.empty()) {
          found.insert(id.value);
          effects = rig.fail(id.value, true);
          break;
        }

    EXPECT_EQ(static_cast<int>(found.size()), std::min(workers, 3)) << workers;
    EXPECT_EQ(attempts, std::max(2, std::min(workers, 3))) << workers;
    ASSERT_EQ(of<JobFailed>(effects).size(), 1u) << workers;
    EXPECT_THAT(of<JobFailed>(effects)[0].error, testing::StartsWith("the scene cannot be rendered: tile 0"));
  }
}

TEST(Failure, LostWorkersDoNotCountAsFailuresOfAUnit) {
  Rig rig;
  rig.submit(plan_of("j", 1, 2));

  for (int i = 0; i < 20; ++i) {
    rig.join("a", 1);
    ASSERT_EQ(rig.held[{"a"}].size(), 1u);
    rig.lose("a");
  }
  rig.join("a", 1);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
}

// Worker "bad" fails every unit that it gets until it is blocked; "good" renders.
std::vector<Effect> bad_worker_against(Rig& rig, const std::string& job) {
  std::vector<Effect> all = rig.submit(plan_of(job, 40, 2));
  for (int guard = 0; rig.job(job).state != JobState::done && guard < 1000; ++guard) {
    const char* name = !rig.held[{"bad"}].empty() ? "bad" : "good";
    for (Effect& e : name[0] == 'b' ? rig.fail(name) : rig.render(name)) all.push_back(std::move(e));
  }
  return all;
}

TEST(Failure, WorkerThatFailsThreeUnitsGetsNoMoreOfTheJob) {
  Rig rig;
  rig.join("bad", 1);
  rig.join("good", 1);

  const auto effects = bad_worker_against(rig, "j");

  ASSERT_EQ(of<WorkerBlocked>(effects).size(), 1u);
  EXPECT_EQ(of<WorkerBlocked>(effects)[0].worker.value, "bad");
  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.worker("bad").state, WorkerState::connected) << "one job alone says little";
}

TEST(Failure, WorkerThatFailsInTwoJobsIsUnhealthyForAWhile) {
  Rig rig;
  rig.join("bad", 1);
  rig.join("good", 1);
  bad_worker_against(rig, "j");
  bad_worker_against(rig, "k");
  EXPECT_EQ(rig.worker("bad").state, WorkerState::unhealthy);

  rig.lose("good");
  rig.submit(plan_of("l", 2, 2));
  EXPECT_EQ(rig.farm.why_waiting({"l"}), "bad is unhealthy");
  rig.pass(kForgiveAfter);

  EXPECT_EQ(rig.worker("bad").state, WorkerState::connected);
  EXPECT_FALSE(rig.held[{"bad"}].empty());
}

TEST(Failure, CrashingScenesDoNotMakeTheirWorkersUnhealthy) {
  Rig rig;
  rig.join("a", 4);
  for (const char* id : {"j", "k", "l"}) {
    rig.submit(plan_of(id, 20, 2));
    for (int i = 0; i < 20 && rig.job(id).state == JobState::running; ++i) rig.fail("a");
    EXPECT_EQ(rig.job(id).state, JobState::failed);
  }

  EXPECT_EQ(rig.worker("a").state, WorkerState::connected);
}

TEST(Failure, IsForgottenOnceTheUnitIsRendered) {
  Rig rig(plan_of("j", 1, 2), {{"a", 1}, {"b", 1}});
  rig.fail("a");

  ASSERT_EQ(rig.held[{"b"}].size(), 1u) << "retried elsewhere";
  rig.render("b");

  EXPECT_EQ(rig.job().state, JobState::done);
}

}  // namespace
}  // namespace ls::coordinator
