// Which job is next, how many units it gets at once, and on which worker.
#include <random>

#include "tests/unit/domain/clockwork.h"

namespace ls::coordinator {
namespace {

JobPlan plan_for(const std::string& owner, const std::string& id, int tiles = 4000, std::uint64_t spp = 2) {
  JobPlan plan = plan_of(id, tiles, spp);
  plan.owner = owner;
  plan.brief.scene = digest_number(std::hash<std::string>{}(id));
  return plan;
}

// By how many core seconds shares may differ on a farm of four workers with two threads each: on each worker
// by one lease and the unit that ends it, and by the preference for loaded worlds.
constexpr double kThreads = 8;
constexpr double kBound = kThreads * (kQueuedLeases * kLeaseSeconds + 1) + kThreads * kLocalitySeconds;

Clockwork four_workers(Farm::Options options = {.lease_prefix = "t"}) {
  Clockwork work(std::move(options));
  for (const char* name : {"a", "b", "c", "d"}) work.join(name, 2);
  return work;
}

bool chance_of(std::mt19937_64& random, std::uint64_t percent) { return random() % 100 < percent; }

TEST(Shares, UsersHaveEqualSharesForAnyNumberOfJobs) {
  Clockwork work = four_workers();
  for (const char* id : {"ann1", "ann2", "ann3"}) work.rig.submit(plan_for("ann", id));
  work.rig.submit(plan_for("bob", "bob1"));

  work.run(200);

  const double ann = work.seconds["ann1"] + work.seconds["ann2"] + work.seconds["ann3"];
  EXPECT_NEAR(ann, work.seconds["bob1"], kBound);
  EXPECT_NEAR(ann + work.seconds["bob1"], 200 * kThreads, kBound) << "nobody idles";
}

TEST(Shares, JobsOfOneUserEndOneAfterTheOtherInTheirOrder) {
  constexpr int kJobs = 64;
  Clockwork work = four_workers();
  for (int i = 0; i < kJobs; ++i) work.rig.submit(plan_for("ann", "shot" + std::to_string(i), 64));

  work.run();

  ASSERT_EQ(work.finished.size(), std::size_t{kJobs});
  // A job takes 64 units of half a second on eight threads: 4 s. The next one begins while the last units of
  // the job before are rendered, and each worker holds kQueuedLeases leases, of at most kLeaseSeconds each.
  const double each = 64 * .5 / kThreads;
  for (int i = 0; i < kJobs; ++i)
    EXPECT_LE(work.finished["shot" + std::to_string(i)], (i + 1) * each + kQueuedLeases * kLeaseSeconds) << i;
}

TEST(Shares, LaterJobOfAUserUsesWorkersThatTheFirstLeavesFree) {
  Rig rig;
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 2);
  JobPlan first = plan_for("ann", "first"), second = plan_for("ann", "second");
  first.max_workers = 1;
  rig.submit(first);
  rig.submit(second);

  EXPECT_GT(rig.job("first").units_leased, 0u);
  EXPECT_GT(rig.job("second").units_leased, 0u);
}

TEST(Shares, ResumedJobKeepsItsPlaceBeforeLaterJobsOfItsUser) {
  Clockwork work = four_workers();
  work.rig.submit(plan_for("ann", "first", 400));
  work.rig.submit(plan_for("ann", "second", 4000));
  work.rig.send(JobPaused{{"first"}});
  work.run(10);
  EXPECT_EQ(work.seconds["first"], kThreads * .5) << "the units that were begun";
  work.rig.send(JobResumed{{"first"}});

  work.run(60);

  ASSERT_TRUE(work.finished.contains("first"));
  EXPECT_LE(work.finished["first"], 10 + 400 * .5 / kThreads + 2 * kQueuedLeases * kLeaseSeconds)
      << "it waits for the leases that were out, and at its end for its own";
}

TEST(Shares, AreMeasuredInCoreSecondsNotInUnits) {
  Clockwork work = four_workers();
  work.cost = [](const UnitKey& unit) { return unit.job.value == "dear" ? 2.0 : .1; };
  work.rig.submit(plan_for("ann", "dear"));
  work.rig.submit(plan_for("bob", "cheap", 20000));

  work.run(200);

  EXPECT_NEAR(work.seconds["dear"], work.seconds["cheap"], kBound);
}

TEST(Shares, LateUsersStartWithAnEqualShareAndNobodyOwesPastTime) {
  Clockwork work = four_workers();
  work.rig.submit(plan_for("ann", "first", 20000));
  work.run(300);
  const double before = work.seconds["first"];
  work.rig.submit(plan_for("bob", "second"));

  work.run(200);

  EXPECT_NEAR(work.seconds["first"] - before, work.seconds["second"], kBound);
  EXPECT_GT(work.seconds["first"] - before, 50 * kThreads)
      << "ann is not made to wait until bob has had as much";
}

TEST(Shares, PausedUsersSaveUpNoTurns) {
  Clockwork work = four_workers();
  work.rig.submit(plan_for("ann", "goes"));
  work.rig.submit(plan_for("bob", "rests"));
  work.run(20);
  work.rig.send(JobPaused{{"rests"}});
  work.run(150);
  const double goes = work.seconds["goes"], rests = work.seconds["rests"];
  work.rig.send(JobResumed{{"rests"}});

  work.run(100);

  EXPECT_NEAR(work.seconds["goes"] - goes, work.seconds["rests"] - rests, kBound);
}

TEST(Shares, ApplyWithinAPriority) {
  Clockwork work = four_workers();
  JobPlan urgent = plan_for("ann", "urgent", 400);
  urgent.priority = 1;
  work.rig.submit(plan_for("bob", "patient"));
  work.rig.submit(urgent);

  work.run(20);

  EXPECT_GT(work.seconds["urgent"], 20 * kThreads - 2 * kThreads * kQueuedLeases * kLeaseSeconds);
}

// Users have any number of jobs of any cost, and workers come and go. All users who have work all the time
// get equal core seconds, up to one lease per worker and the preference for loaded worlds.
TEST(Shares, DifferByABoundedAmountInRandomHistories) {
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    std::mt19937_64 random(seed);
    const auto pick = [&](std::uint64_t n) { return random() % n; };
    Clockwork work;
    const std::uint64_t users = 2 + pick(3);
    std::map<std::string, double> costs;
    std::map<std::string, std::string> owners;
    for (std::uint64_t u = 0; u < users; ++u)
      for (std::uint64_t j = 0; j <= pick(3); ++j) {
        const std::string id = "u" + std::to_string(u) + "-" + std::to_string(j);
        costs[id] = .1 * static_cast<double>(1 + pick(20));
        owners[id] = "u" + std::to_string(u);
        work.rig.submit(plan_for(owners[id], id, 30000));
      }
    work.cost = [&](const UnitKey& unit) { return costs.at(unit.job.value); };
    const std::uint64_t workers = 3 + pick(4);
    const auto name = [&](std::uint64_t i) { return "w" + std::to_string(i); };
    double threads = 0;
    for (std::uint64_t i = 0; i < workers; ++i)
      work.join(name(i), 1 + static_cast<int>(i % 3)), threads += 1 + static_cast<double>(i % 3);
    for (int turn = 0; turn < 8; ++turn) {
      const std::uint64_t i = pick(workers);
      chance_of(random, 50) ? work.lose(name(i)) : work.join(name(i), 1 + static_cast<int>(i % 3));
      work.run(10 + static_cast<double>(pick(20)));
    }
    ASSERT_EQ(audit(work.rig.farm), "") << "seed " << seed;
    std::map<std::string, double> had;
    for (const auto& [id, owner] : owners) had[owner] += work.seconds[id];
    const auto [least, most] = std::minmax_element(
        had.begin(), had.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    EXPECT_LE(most->second - least->second, threads * (kQueuedLeases * kLeaseSeconds + 2 + kLocalitySeconds))
        << "seed " << seed;
  }
}

TEST(Held, HeldJobGetsNoWorkerUntilItIsReleased) {
  Rig rig;
  rig.join("a", 2);
  JobPlan plan = plan_for("ann", "later", 40);
  plan.held = true;
  rig.submit(plan);
  rig.submit(plan_for("ann", "other", 2));
  EXPECT_EQ(rig.job("later").units_leased, 0u);
  EXPECT_EQ(rig.job("later").state, JobState::queued);
  EXPECT_EQ(rig.farm.why_waiting({"later"}), "") << "workers do not keep it";
  EXPECT_EQ(rig.job("other").units_leased, 2u);

  rig.send(JobHeld{{"later"}, false});

  EXPECT_GT(rig.job("later").units_leased, 0u);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Held, RunningJobThatIsHeldKeepsItsLeasesAndGetsNoMore) {
  Rig rig;
  rig.join("a", 2);
  rig.submit(plan_for("ann", "j", 400));
  const std::uint64_t leased = rig.job("j").units_leased;
  rig.send(JobHeld{{"j"}, true});
  EXPECT_EQ(rig.job("j").units_leased, leased);

  while (!rig.held[{"a"}].empty()) rig.render("a");

  EXPECT_EQ(rig.job("j").units_leased, 0u);
  EXPECT_EQ(rig.job("j").units_done, leased);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Shares, FramesOfASequenceAreRenderedInOrderBeforeALaterJobOfTheirUser) {
  Clockwork work = four_workers();
  for (int frame = 1; frame <= 5; ++frame) {
    JobPlan plan = plan_for("ann", "s-frame" + std::to_string(frame), 400);
    plan.group = "s";
    work.rig.submit(plan);
  }
  work.rig.submit(plan_for("ann", "still"));

  work.run(30);

  EXPECT_EQ(work.seconds["s-frame1"], 400 * .5);
  EXPECT_GT(work.seconds["s-frame2"], 0);
  EXPECT_EQ(work.seconds["s-frame3"], 0);
  EXPECT_EQ(work.seconds["still"], 0);
}

TEST(Shares, FiguresListTheTimeOfEachUser) {
  Clockwork work = four_workers();
  work.rig.submit(plan_for("ann", "j"));

  work.run(50);

  const auto shares = ls::coordinator::shares(work.rig.farm);
  ASSERT_EQ(shares.size(), 1u);
  EXPECT_EQ(shares[0].owner, "ann");
  EXPECT_GE(shares[0].seconds, work.seconds["j"]);
}

std::size_t workers_on(const Rig& rig, const std::vector<std::string>& jobs) {
  std::size_t n = 0;
  for (const auto& [id, held] : rig.held)
    n += std::any_of(held.begin(), held.end(), [&](const Rig::Held& h) {
      return std::find(jobs.begin(), jobs.end(), h.job.value) != jobs.end();
    });
  return n;
}

TEST(Limits, JobLimitsBoundItsWorkersAndUnits) {
  Rig rig;
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 2);
  JobPlan few = plan_for("ann", "few"), small = plan_for("ann", "small");
  few.max_workers = 2;
  small.max_units = 3;
  rig.submit(few);
  EXPECT_EQ(workers_on(rig, {"few"}), 2u);
  rig.submit(small);

  for (int i = 0; i < 200; ++i) {
    rig.render(i % 2 ? "a" : "d");
    EXPECT_LE(workers_on(rig, {"few"}), 2u);
    EXPECT_LE(rig.job("small").units_leased, 3u);
    ASSERT_EQ(audit(rig.farm), "");
  }
  EXPECT_GT(rig.job("few").units_done, 0u);
  EXPECT_GT(rig.job("small").units_done, 0u);
}

TEST(Limits, SequenceLimitsHoldForAllFrames) {
  Rig rig;
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 2);
  for (const char* id : {"s-frame1", "s-frame2"}) {
    JobPlan plan = plan_for("ann", id, 2);
    plan.group = "s";
    plan.max_workers = 2;
    plan.max_units = 3;
    rig.submit(plan);
  }

  EXPECT_EQ(workers_on(rig, {"s-frame1", "s-frame2"}), 2u);
  EXPECT_EQ(rig.job("s-frame1").units_leased + rig.job("s-frame2").units_leased, 3u);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Limits, UserLimitsHoldForAllJobsOfAUserButNotForTheAdmin) {
  Rig rig({.lease_prefix = "t", .limits = {.workers_per_user = 1, .units_per_user = 3}});
  for (const char* name : {"a", "b", "c", "d"}) rig.join(name, 2);
  rig.submit(plan_for("ann", "one"));
  rig.submit(plan_for("ann", "two"));
  EXPECT_EQ(workers_on(rig, {"one", "two"}), 1u);
  EXPECT_EQ(rig.job("one").units_leased + rig.job("two").units_leased, 3u);
  rig.submit(plan_for("", "admin"));

  EXPECT_EQ(workers_on(rig, {"admin"}), 4u);
  EXPECT_EQ(rig.job("one").units_leased + rig.job("two").units_leased, 3u);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Limits, ReturnedUnitsGoToAnotherWorker) {
  Rig rig;
  rig.join("a", 1);
  rig.join("b", 1);
  JobPlan plan = plan_for("ann", "j", 3);
  plan.max_workers = 1;
  rig.submit(plan);
  EXPECT_EQ(workers_on(rig, {"j"}), 1u);
  const std::string holder = rig.held[{"a"}].empty() ? "b" : "a";

  rig.lose(holder);

  EXPECT_FALSE(rig.held[{holder == "a" ? "b" : "a"}].empty());
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(Memory, JobGoesOnlyToWorkersWithEnoughMemory) {
  Rig rig;
  rig.join("small", 1, 1, {}, 4ull << 30);
  rig.join("large", 1, 1, {}, 16ull << 30);
  rig.join("silent", 1);
  JobPlan plan = plan_for("ann", "j", 100);
  plan.memory_bytes = 8ull << 30;

  rig.submit(plan);

  EXPECT_TRUE(rig.held[{"small"}].empty());
  EXPECT_FALSE(rig.held[{"large"}].empty());
  EXPECT_FALSE(rig.held[{"silent"}].empty()) << "what a worker has is not held against it if it has not said";
}

TEST(Memory, JobTooLargeForAllWorkersSaysSo) {
  Rig rig;
  rig.join("a", 1, 1, {}, 4ull << 30);
  rig.join("b", 1, 1, {}, 900ull << 20);
  JobPlan plan = plan_for("ann", "j", 100);
  plan.memory_bytes = 8ull << 30;

  rig.submit(plan);

  EXPECT_EQ(
      rig.farm.why_waiting({"j"}),
      "a has 4.0 GiB of memory and the job needs at least 8.0 GiB; b has 900 MiB of memory and the job needs "
      "at least 8.0 GiB");
  rig.join("c", 1, 1, {}, 8ull << 30);
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "");
}

TEST(Locality, WorkerThatHasTheFilesGoesFirst) {
  Rig rig;
  JobPlan plan = plan_for("ann", "j", 1);
  rig.join("a", 1);
  rig.join("b", 1, 1, {}, 0, {plan.brief.scene});

  rig.submit(plan);

  EXPECT_TRUE(rig.held[{"a"}].empty());
  EXPECT_FALSE(rig.held[{"b"}].empty());
}

// With two jobs and eight workers, every worker would soon hold both worlds if loaded worlds were not
// preferred.
TEST(Locality, WorkersKeepTheirWorldAndNoJobStarves) {
  Clockwork work;
  for (int i = 0; i < 8; ++i) {
    work.join("w" + std::to_string(i), 1);
    work.slow["w" + std::to_string(i)] = 1 + .02 * i;  // so that workers do not stay in step
  }
  work.rig.submit(plan_for("ann", "one"));
  work.run(30);
  EXPECT_EQ(work.units["one"].size(), 8u);
  work.rig.submit(plan_for("bob", "two"));
  work.run(2.5);
  EXPECT_TRUE(std::any_of(work.rig.held.begin(), work.rig.held.end(), [](const auto& w) {
    return std::any_of(w.second.begin(), w.second.end(), [](const auto& h) { return h.job.value == "two"; });
  })) << "a job that nobody renders does not wait";

  const double before = work.seconds["one"];
  work.run(200);

  EXPECT_LT(work.units["two"].size(), 8u) << "half of the farm is enough for half of its time";
  EXPECT_NEAR(work.seconds["one"] - before, work.seconds["two"],
              8 * (kQueuedLeases * kLeaseSeconds + 1) + 2 * 8 * kLocalitySeconds);
}

TEST(Tail, CopiesOfTheSlowestUnitsEndAJobSooner) {
  Clockwork work;
  for (int i = 0; i < 4; ++i) work.join("w" + std::to_string(i), 1);
  work.slow = {{"w3", 40}};
  work.rig.submit(plan_for("ann", "j", 60));

  work.run();

  // Sixty units of half a second take 10 s on the three fast workers; the slow worker needs 20 s for its
  // first unit alone.
  ASSERT_TRUE(work.finished.contains("j"));
  EXPECT_LT(work.finished["j"], 13);
  EXPECT_EQ(work.accepted.size(), 60u);
  EXPECT_LE(work.seconds["j"], 62 * .5) << "no more than what was out there is rendered twice";
}

TEST(Limits, AuditDoesNotWaitForTheUsersOtherWork) {
  Clockwork work({.lease_prefix = "t", .limits = {.workers_per_user = 1}, .audit_rate = 1, .audit_seed = 7});
  for (const char* name : {"a", "b"}) work.join(name, 1);
  for (const auto& [id, tiles] : {std::pair("one", 4), {"two", 200}}) {
    JobPlan plan = plan_of(id, tiles, 2);
    plan.owner = "ann";
    work.rig.submit(plan);
  }

  work.run();

  ASSERT_EQ(work.finished.size(), 2u);
  EXPECT_LT(work.finished["one"], work.finished["two"] / 2);
  EXPECT_EQ(work.rig.farm.audits().equal, 204u);
  EXPECT_EQ(audit(work.rig.farm), "");
}

}  // namespace
}  // namespace ls::coordinator
