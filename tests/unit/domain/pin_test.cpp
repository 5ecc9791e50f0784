// Which numeric class a job may be pinned to when its results are audited.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

Farm::Options audited(double rate) {
  return {.lease_prefix = "t", .limits = {}, .audit_rate = rate, .audit_seed = 7};
}

TEST(Pin, LoneWorkerOfAClassPinsNoJobThatAnotherClassCanAudit) {
  Rig rig(audited(.01));
  rig.join("x", 1, 9);
  for (const char* name : {"a", "b", "c"}) rig.join(name, 1, 1);

  rig.submit(plan_of("j", 40, 2));

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_TRUE(rig.held[{"x"}].empty());
  EXPECT_FALSE(rig.farm.may_pin({"j2"}, {"x"}));
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, LoneWorkerRendersIfNoClassHasTwoWorkersAndTheReportSaysSo) {
  Rig rig(audited(1));
  rig.join("x", 1, 9);
  rig.join("a", 1, 1);
  rig.submit(plan_of("j", 4, 2));
  EXPECT_EQ(rig.job().numeric_class, digest_number(9));

  const auto effects = rig.render_all();

  ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
  EXPECT_EQ(of<JobFinished>(effects)[0].unaudited, 4u);
  EXPECT_EQ(rig.farm.audits().missed, 4u);
}

TEST(Pin, FirstWorkerPinsIfNothingIsAudited) {
  Rig rig(audited(0));
  rig.join("x", 1, 9);
  for (const char* name : {"a", "b"}) rig.join(name, 1, 1);

  rig.submit(plan_of("j", 40, 2));

  EXPECT_EQ(rig.job().numeric_class, digest_number(9));
}

TEST(Pin, WorkerOfAnotherVersionFinishesJobsOfItsClassButBeginsNone) {
  Rig rig;
  rig.join("old", 1, 1);
  rig.submit(plan_of("begun", 2, 2));
  rig.render("old");
  ASSERT_EQ(rig.farm.job({"begun"})->numeric_class, digest_number(1));
  rig.lose("old");

  rig.join_another_version("old", 1, 1);
  rig.submit(plan_of("new", 4, 2));
  EXPECT_EQ(rig.held[{"old"}].size(), 1u) << "the unit of the job that it began, and no other";
  EXPECT_EQ(rig.held[{"old"}].front().job.value, "begun");
  EXPECT_EQ(rig.farm.why_waiting({"new"}),
            "old is of another version than the coordinator and begins no job");
  EXPECT_EQ(audit(rig.farm), "");

  rig.join("new", 1, 2);
  EXPECT_EQ(rig.farm.job({"new"})->numeric_class, digest_number(2));
  EXPECT_EQ(rig.farm.why_waiting({"new"}), "");
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, WorkersThatMayNotBeginAJobGetUnitsOnceItIsPinnedToTheirClass) {
  for (const bool chosen : {true, false}) {
    Rig rig;
    rig.join_another_version("old", 1, 1);
    rig.submit(plan_of("j", 40, 2));
    ASSERT_TRUE(rig.held[{"old"}].empty());

    if (chosen)
      rig.send(ClassChosen{{"j"}, digest_number(1)});  // chosen by a result from before a restart
    else
      rig.join("of the same class", 1, 1);

    EXPECT_FALSE(rig.held[{"old"}].empty());
    EXPECT_EQ(audit(rig.farm), "");
  }
}

TEST(Pin, FirstStoredResultDecidesTheClass) {
  Rig rig(audited(0));
  rig.submit(plan_of("j", 4, 2));
  EXPECT_FALSE(rig.farm.wanted({{"j"}, 0, 0}, digest_number(1)).pinned);

  const auto pinned = of<JobPinned>(rig.send(ClassChosen{{"j"}, digest_number(1)}));
  const auto again = rig.send(ClassChosen{{"j"}, digest_number(2)});

  ASSERT_EQ(pinned.size(), 1u);
  EXPECT_EQ(pinned[0].numeric_class, digest_number(1));
  EXPECT_TRUE(of<JobPinned>(again).empty());
  EXPECT_EQ(rig.farm.wanted({{"j"}, 0, 0}, digest_number(2)).verdict, Wanted::Verdict::other_class);
  EXPECT_EQ(audit(rig.farm), "");
}

// Two streams of a made-up class take the first leases of a job and never deliver.
TEST(Pin, ClassWhoseLeasesEndedWithoutAResultIsGivenUp) {
  Rig rig;
  rig.join("x1", 64, 9);
  rig.join("x2", 64, 9);
  rig.submit(plan_of("j", 40, 2));
  rig.join("honest", 1, 1);
  ASSERT_EQ(rig.job().numeric_class, digest_number(9));
  EXPECT_TRUE(rig.held[{"honest"}].empty());

  rig.lose("x1");
  const auto effects = rig.lose("x2");

  EXPECT_EQ(of<JobUnpinned>(effects).size(), 1u);
  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_FALSE(rig.held[{"honest"}].empty());
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, OneFruitlessWorkerDoesNotExcludeItsClass) {
  Rig rig;
  rig.join("broken", 1, 1);
  rig.submit(plan_of("j", 1, 2));
  rig.join("sound", 1, 1);
  rig.join("x", 1, 9);

  rig.give_back("broken", "its disk is full");

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_EQ(rig.held[{"sound"}].size(), 1u);
  EXPECT_EQ(audit(rig.farm), "");
}

// One process takes the job's only unit again and again, each time as a new worker, and leaves with it.
TEST(Pin, ClassIsSkippedAfterSeveralOfItsWorkersReturnNoResult) {
  Rig rig;
  rig.join("x0", 1, 9);
  rig.submit(plan_of("j", 1, 2));
  rig.join("honest", 1, 1);

  int lost = 0;
  for (; rig.held[{"honest"}].empty() && lost < 10; ++lost) {
    for (const char* more : {"a", "b"}) rig.join("x" + std::to_string(lost + 1) + more, 1, 9);
    for (auto& [name, units] : rig.held)
      if (!units.empty()) {
        rig.lose(std::string(name.value));
        break;
      }
  }

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_LE(lost, 3) << "kFruitlessLeases";
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, ClassWithoutResultsForLongIsReplacedByAnIdleWorkersClass) {
  for (const bool others : {true, false}) {
    Rig rig;
    rig.join("x1", 64, 9);
    rig.submit(plan_of("j", 40, 2));
    if (others) rig.join("honest", 1, 1);
    const auto report = [&] {
      LeaseProgress progress{{"x1"}, {}};
      for (const auto& held : rig.held[{"x1"}]) progress.leases.push_back({held.lease, 0});
      rig.send(progress);
    };

    for (Duration waited{}; waited <= kPinLimit; waited += 10s) report(), rig.pass(10s);

    EXPECT_EQ(rig.job().numeric_class, digest_number(others ? 1 : 9));
    EXPECT_EQ(rig.held[{"honest"}].empty(), !others);
    EXPECT_EQ(audit(rig.farm), "");
  }
}

// The worker reports that it still has all units that it holds.
void report(Rig& rig, const char* name) {
  LeaseProgress progress{{name}, {}};
  for (const auto& held : rig.held[{name}]) progress.leases.push_back({held.lease, 0});
  rig.send(progress);
}

TEST(Pin, SlowToLoadJobDoesNotAlternateBetweenTwoClasses) {
  Rig rig;
  rig.join("a", 1, 1);
  rig.join("b", 1, 9);
  rig.submit(plan_of("j", 4, 2));

  Duration loading{};
  for (Duration waited{}; loading < 500s && waited < 1h; waited += 10s) {
    for (const char* name : {"a", "b"}) report(rig, name);
    loading = of<JobUnpinned>(rig.pass(10s)).empty() ? loading + 10s : Duration{};
  }

  EXPECT_EQ(loading, 500s);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, PausedTimeDoesNotCountAgainstTheJobsClass) {
  Rig rig;
  rig.join("a", 1, 1);
  rig.submit(plan_of("j", 4, 2));
  rig.join("b", 1, 9);

  rig.send(JobPaused{{"j"}});
  for (Duration waited{}; waited < 2 * kPinLimit; waited += 10s) report(rig, "a"), rig.pass(10s);
  rig.send(JobResumed{{"j"}});
  rig.pass(1s);

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
}

TEST(Pin, ClassWithAnAcceptedResultStays) {
  Rig rig;
  rig.join("a", 1, 1);
  rig.submit(plan_of("j", 40, 2));
  rig.render("a");
  rig.join("b", 1, 2);

  rig.lose("a");
  rig.pass(2 * kPinLimit);

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_TRUE(rig.held[{"b"}].empty());
}

TEST(Pin, NewJobGoesToIdleWorkersOfAProvenClass) {
  for (const double rate : {0., .01}) {
    Rig rig(audited(rate));
    rig.join("honest", 1, 1);
    rig.submit(plan_of("first", 1, 2));
    rig.render_all();
    ASSERT_EQ(rig.farm.job({"first"})->state, JobState::done);
    rig.join("x1", 64, 9);
    rig.join("x2", 64, 9);

    rig.submit(plan_of("j", 40, 2));

    EXPECT_EQ(rig.job().numeric_class, digest_number(1)) << "audit rate " << rate;
    EXPECT_EQ(audit(rig.farm), "");
    // The honest worker is busy now: another job does not wait for it.
    rig.submit(plan_of("k", 40, 2));
    EXPECT_EQ(rig.farm.job({"k"})->numeric_class, digest_number(9));
    EXPECT_EQ(audit(rig.farm), "");
  }
}

// Its unit fails on the only worker of the class that has delivered; the other class must get its turn.
TEST(Pin, FailedUnitGoesToAnotherClassIfNoResultWasAccepted) {
  Rig rig;
  rig.join("honest", 1, 1);
  rig.submit(plan_of("first", 1, 2));
  rig.render_all();
  rig.join("x", 1, 9);
  rig.submit(plan_of("j", 1, 2));
  ASSERT_EQ(rig.held[{"honest"}].size(), 1u);

  rig.fail("honest");

  EXPECT_EQ(rig.held[{"honest"}].size() + rig.held[{"x"}].size(), 1u);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Pin, JobThatRequestsAClassWaitsForItAndListsThePresentOnes) {
  for (const std::string asked : {digest_number(9).hex().substr(0, 12), std::string("armv8-a:gcc-14")}) {
    Rig rig(audited(.01));
    for (const char* name : {"a", "b"}) rig.join_of_platform(name, 1, 1, "x86-64-v3:gcc-12.2.0");
    JobPlan plan = plan_of("j", 40, 2);
    plan.class_asked = asked;

    rig.submit(plan);
    EXPECT_TRUE(rig.held[{"a"}].empty());
    EXPECT_EQ(rig.farm.why_waiting({"j"}),
              "a is of numeric class 010000000000 (x86-64-v3:gcc-12.2.0) and the job asks for '" + asked +
                  "'; b is of numeric class 010000000000 (x86-64-v3:gcc-12.2.0) and the job asks for '" +
                  asked + "'");

    rig.join_of_platform("arm", 1, 9, "armv8-a:gcc-14.2.0");
    EXPECT_EQ(rig.job().numeric_class, digest_number(9)) << "although it is alone in its class";
    EXPECT_FALSE(rig.held[{"arm"}].empty());
    EXPECT_EQ(audit(rig.farm), "");
  }
}

TEST(Pin, PinnedJobReportsItsShareOfTheFarm) {
  Rig rig;
  rig.submit(plan_of("j", 400, 2));
  EXPECT_EQ(rig.job().class_share, std::nullopt);

  rig.join("a", 2, 1);
  EXPECT_EQ(rig.job().class_share, (ClassShare{1, 1, 2, 2}));
  rig.render("a");  // the class is final
  rig.join("b", 6, 9);
  rig.join("c", 4, 1);
  EXPECT_EQ(rig.job().class_share, (ClassShare{2, 3, 6, 12}));
  rig.lose("a");
  EXPECT_EQ(rig.job().class_share, (ClassShare{1, 2, 4, 10}));
  rig.send(WorkerQuarantined{{"c"}, "wrong pixels"});
  EXPECT_EQ(rig.job().class_share, (ClassShare{0, 1, 0, 6}));
  rig.lose("b");
  rig.lose("c");
  EXPECT_EQ(rig.job().class_share, (ClassShare{0, 0, 0, 0}));
}

}  // namespace
}  // namespace ls::coordinator
