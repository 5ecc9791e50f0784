// What a single participant of the farm can do by opening several streams, each of them a worker, or by what
// it says of its results. A principal is who answers for a worker: its address or its certificate.
#include "tests/unit/domain/clockwork.h"

namespace ls::coordinator {
namespace {

Farm::Options all_audited() { return {.lease_prefix = "t", .limits = {}, .audit_rate = 1, .audit_seed = 7}; }

// "x1" and "x2", of one principal, render the same wrong pixels.
Clockwork farm_with_two_faces(const std::vector<std::string>& honest_workers) {
  Clockwork work(all_audited());
  work.rig.principals = {{"x1", "mallory"}, {"x2", "mallory"}};
  work.pixels = [](const std::string& worker, const UnitKey& unit, const SampleRange& range) {
    return worker.starts_with("x") ? digest_number(1 + unit.tile) : honest(unit, range);
  };
  for (const char* name : {"x1", "x2"}) work.join(name, 1);
  for (const std::string& name : honest_workers) work.join(name, 1);
  work.rig.submit(plan_of("j", 20, 4));
  return work;
}

TEST(Principal, TwoWorkersOfOnePrincipalCannotQuarantineAnHonestWorker) {
  Clockwork work = farm_with_two_faces({"a"});

  work.run();

  for (const auto& found : work.seen<WorkerFoundFaulty>())
    EXPECT_NE(found.worker.value, "a") << found.evidence;
  // Nobody else can decide: the job says so rather than choose.
  EXPECT_EQ(work.rig.job().state, JobState::failed);
  EXPECT_EQ(audit(work.rig.farm), "");
}

TEST(Principal, TwoHonestPrincipalsFindBothFaultyWorkers) {
  Clockwork work = farm_with_two_faces({"a", "b"});

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  EXPECT_FALSE(work.seen<WorkerFoundFaulty>().empty());
  for (const auto& found : work.seen<WorkerFoundFaulty>()) EXPECT_TRUE(found.worker.value.starts_with("x"));
  for (const auto& [unit, digest] : work.accepted)
    EXPECT_EQ(digest, honest(unit, cut_range(unit.round, 4))) << unit.tile;
  EXPECT_EQ(audit(work.rig.farm), "");
}

// All workers are behind one address: there is nobody else whom they could harm, and a worker with bad memory
// is still found.
TEST(Principal, WorkersOfASinglePrincipalDecideAmongThemselves) {
  Clockwork work(all_audited());
  work.pixels = [](const std::string& worker, const UnitKey& unit, const SampleRange& range) {
    return worker == "bad" ? digest_number(1 + unit.tile) : honest(unit, range);
  };
  for (const char* name : {"a", "bad", "b"}) {
    work.rig.principals[name] = "one address";
    work.join(name, 1);
  }
  work.rig.submit(plan_of("j", 20, 4));

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  ASSERT_EQ(work.seen<WorkerFoundFaulty>().size(), 1u);
  EXPECT_EQ(work.seen<WorkerFoundFaulty>()[0].worker.value, "bad");
}

// Machines with two workers each: a neighbour of the worker with bad memory may speak against it.
TEST(Principal, WorkerMayVoteAgainstANeighbour) {
  Clockwork work(all_audited());
  work.rig.principals = {{"a", "one"}, {"bad", "one"}, {"b", "two"}, {"c", "two"}};
  work.pixels = [](const std::string& worker, const UnitKey& unit, const SampleRange& range) {
    return worker == "bad" ? digest_number(1 + unit.tile) : honest(unit, range);
  };
  for (const char* name : {"a", "bad", "b", "c"}) work.join(name, 1);
  work.rig.submit(plan_of("j", 20, 4));

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  ASSERT_EQ(work.seen<WorkerFoundFaulty>().size(), 1u);
  EXPECT_EQ(work.seen<WorkerFoundFaulty>()[0].worker.value, "bad");
}

TEST(Principal, AuditGoesToAnotherPrincipalIfThereIsOne) {
  for (const bool other : {true, false}) {
    Rig rig(all_audited());
    rig.principals = {{"x1", "mallory"}, {"x2", "mallory"}};
    for (const char* name : {"x1", "x2"}) rig.join(name, 1);
    if (other) rig.join("a", 1);
    rig.submit(plan_of("j", 3, 2));
    const UnitKey unit = rig.held[{"x1"}].front().key();
    rig.render("x1");
    // The audited unit goes to a worker as soon as that has room for it
    std::set<std::string> auditors;
    for (int i = 0; i < 10; ++i)
      for (const char* name : {"x2", "a"}) {
        for (const auto& held : rig.held[{name}])
          if (held.key() == unit) auditors.insert(name);
        if (!rig.held[{name}].empty()) rig.render(name);
      }

    EXPECT_EQ(auditors, (std::set<std::string>{other ? "a" : "x2"}));
  }
}

// One process opens stream after stream, each a new worker that fails the same unit.
TEST(Principal, PrincipalThatFailsAUnitUnderManyNamesFailsNoJob) {
  for (const bool one_address : {true, false}) {
    Rig rig;
    rig.principals["honest"] = one_address ? "here" : "there";
    rig.join("honest", 1);
    rig.submit(plan_of("first", 1, 2));
    rig.render_all();
    rig.submit(plan_of("j", 3, 2));
    for (int i = 0; i < 8; ++i) {
      const std::string name = "x" + std::to_string(i);
      rig.principals[name] = "here";
      rig.join(name, 1);
      rig.pass(1s);  // an idle worker gets a copy of what is overdue
      while (!rig.held[{name}].empty()) rig.fail(name);
      rig.lose(name);
      ASSERT_EQ(rig.job().state, JobState::running) << i << " under one address: " << one_address;
      ASSERT_EQ(audit(rig.farm), "");
    }

    rig.render_all();

    EXPECT_EQ(rig.job().state, JobState::done);
  }
}

TEST(Principal, UnitThatFailsAtThreePrincipalsFailsTheJobEvenWithManyWorkers) {
  Rig rig;
  for (int i = 0; i < 9; ++i) {
    const std::string name = "w" + std::to_string(i);
    rig.principals[name] = "machine " + std::to_string(i % 3);
    rig.join(name, 1);
  }
  rig.submit(plan_of("j", 1, 2));

  int attempts = 0;
  while (rig.job().state == JobState::running && attempts < 20)
    for (auto& [id, units] : rig.held)
      if (!units.empty()) {
        rig.fail(id.value), ++attempts;
        break;
      }

  EXPECT_EQ(rig.job().state, JobState::failed);
  EXPECT_LE(attempts, 7) << "three workers of each of two machines, and one of the third";
}

JobPlan plan_of_user(const std::string& owner) {
  JobPlan plan = plan_of(owner, 4000, 2);
  plan.owner = owner;
  return plan;
}

// Two users have a big job each. One worker says that each of its units took a day.
TEST(Lies, FalseCostsDoNotStarveAUser) {
  Clockwork work;
  for (const char* name : {"a", "b", "liar"}) work.join(name, 2);
  work.cost = [](const UnitKey&) { return .1; };
  work.lies["liar"] = 86399;
  for (const char* owner : {"alice", "bob"}) work.rig.submit(plan_of_user(owner));

  work.run(60);

  // Of two users that differ by one lease on each worker and the preference for loaded worlds. A lie is
  // believed to take all of the worker's threads for the time since it got work; so the liar's part, a third
  // of the farm, may count double.
  const double bound = 6 * (kLeaseLimit + kLocalitySeconds) + 6;
  EXPECT_NEAR(work.seconds["alice"], work.seconds["bob"], bound);
  EXPECT_GT(work.seconds["alice"] + work.seconds["bob"], 60 * 4) << "the honest two are busy all the time";
}

// Lies of cost size no leases: what the honest workers get lasts as long as ever.
TEST(Lies, FalseCostsDoNotChangeLeasesOfOthers) {
  for (const double lie : {0., 86399., 1e300}) {
    Clockwork work;
    for (const char* name : {"a", "liar"}) work.join(name, 1);
    work.cost = [](const UnitKey&) { return .01; };
    work.lies["liar"] = lie;
    work.rig.submit(plan_of("j", 500, 64));

    work.run(60);

    for (const auto& [id, lease] : work.leases)
      ASSERT_LE(lease.ended - lease.begun, kLeaseLimit + lease.longest + 1e-6) << lie;
    EXPECT_GT(work.units["j"]["a"], 500u) << "the honest worker had work throughout, said " << lie;
  }
}

// A result that says that it took an hour must not use up the time of its job.
TEST(Lies, FalseCostsDoNotEndAJobByTime) {
  Clockwork work;
  work.join("liar", 1);
  work.lies["liar"] = 3600;
  work.cost = [](const UnitKey&) { return .1; };
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 10;
  work.rig.submit(plan);

  work.run(100);

  EXPECT_EQ(work.rig.job().stopped, StopReason::time);
  EXPECT_GE(work.finished["j"], 10 - .1 - 1e-6);
}

// Its stream breaks every half second. What it says of the units that it held then has the same bound.
TEST(Lies, FalseCostsOfUnitsLeasedBeforeAReconnectDoNotEndAJobByTime) {
  Clockwork work;
  work.join("liar", 1);
  work.lies["liar"] = 3600;
  work.cost = [](const UnitKey&) { return .1; };
  JobPlan plan = plan_of("j", 4, std::nullopt);
  plan.time = 10;
  work.rig.submit(plan);

  for (int i = 0; i < 40; ++i) {
    work.run(.5);
    work.lose("liar");
    work.join("liar", 1);
  }

  EXPECT_EQ(work.rig.job().stopped, StopReason::time);
  EXPECT_GE(work.finished["j"], 10 - .1 - 1e-6);
}

// A worker with two threads that has held units for three seconds when its stream breaks, or when their
// deadline passes while it is silent. It is there again one second later.
struct Interrupted {
  explicit Interrupted(bool lost, bool others) {
    rig.own_time = true;
    rig.join("w", 2);
    rig.submit(plan_of("j", 100, 2));
    units.assign(rig.held[{"w"}].begin(), rig.held[{"w"}].end());
    begin = rig.now;
    rig.now += lost ? Duration{3s} : Duration{kLoadSlack + kDeadlineSlack};
    if (others) rig.join("other", 64);
    if (lost) {
      rig.lose("w");
      rig.now += 1s;
      rig.join("w", 2);
    } else {
      rig.pass(1s);
      rig.send(LeaseProgress{{"w"}, {}});
    }
    elapsed = seconds(rig.now - begin);
  }
  double credible(const Rig::Held& unit, double reported) {
    return rig.farm.believable_seconds(unit.key(), {"w"}, reported, rig.now);
  }
  Rig rig;
  std::vector<Rig::Held> units;
  TimePoint begin{};
  double elapsed = 0;
};

TEST(Cost, CostOfUnitsLeasedBeforeAnInterruptionCountsFromTheirFirstLease) {
  for (const bool lost : {true, false})
    for (const bool others : {true, false}) {
      SCOPED_TRACE(testing::Message() << (lost ? "lost" : "silent") << (others ? ", others took them" : ""));
      Interrupted now(lost, others);
      ASSERT_GE(now.units.size(), 3u);

      EXPECT_DOUBLE_EQ(now.credible(now.units[0], 2.5), 2.5);
      EXPECT_DOUBLE_EQ(now.credible(now.units[0], 1e6), now.elapsed) << "one thread renders a unit";
      now.rig.cpu_seconds = now.elapsed;
      now.rig.result("w", now.units[0]);
      now.rig.cpu_seconds = now.elapsed - 1;
      now.rig.result("w", now.units[1]);
      EXPECT_DOUBLE_EQ(now.credible(now.units[2], 1e6), 1) << "two threads had no more time together";
    }
}

TEST(Cost, CostOfAForgottenWorkersUnitsCountsFromItsReturn) {
  Rig rig;
  rig.own_time = true;
  rig.now += 1h;
  rig.join("w", 1);
  rig.submit(plan_of("j", 2, 2));
  const std::vector<Rig::Held> units(rig.held[{"w"}].begin(), rig.held[{"w"}].end());
  ASSERT_EQ(units.size(), 2u);
  rig.join("other", 64);
  rig.lose("w");
  rig.pass(kForgetWorkerAfter);
  ASSERT_FALSE(rig.farm.worker({"w"}));
  rig.send(JobPaused{{"j"}});
  rig.join("w", 1);
  rig.now += 2s;

  EXPECT_DOUBLE_EQ(rig.farm.believable_seconds(units[0].key(), {"w"}, 1e6, rig.now), 2);
}

TEST(Cost, CostOfNewUnitsIsAcceptedAfterUnitsFromBeforeAnInterruptionTookLong) {
  Interrupted now(true, true);
  now.rig.lose("other");  // so that the units of the job are there for the worker
  ASSERT_FALSE(now.rig.held[{"w"}].empty());
  now.rig.cpu_seconds = now.elapsed;
  for (int i : {0, 1}) now.rig.result("w", now.units[static_cast<std::size_t>(i)]);
  const auto fresh = std::find_if(now.rig.held[{"w"}].begin(), now.rig.held[{"w"}].end(), [&](const auto& u) {
    return std::none_of(now.units.begin(), now.units.end(),
                        [&](const auto& o) { return o.key() == u.key(); });
  });
  ASSERT_NE(fresh, now.rig.held[{"w"}].end());

  now.rig.now += 2s;

  EXPECT_DOUBLE_EQ(now.credible(*fresh, 1e6), 2);
}

TEST(Lies, WorkerIsNotCreditedMoreTimeThanItsThreadsHad) {
  Rig rig;
  rig.own_time = true;
  rig.join("w", 2);
  rig.submit(plan_of("j", 100, 2));
  const auto credible = [&](double reported) {
    return rig.farm.believable_seconds(rig.held[{"w"}].front().key(), {"w"}, reported, rig.now);
  };
  rig.now += 3s;

  EXPECT_DOUBLE_EQ(credible(2), 2);
  EXPECT_DOUBLE_EQ(credible(100), 3) << "one thread renders a unit";
  rig.cpu_seconds = 3;
  rig.render("w");
  EXPECT_DOUBLE_EQ(credible(100), 3) << "another thread had as much time";
  rig.cpu_seconds = 2;
  rig.render("w");
  EXPECT_DOUBLE_EQ(credible(100), 1) << "two threads have had six seconds together";
  rig.cpu_seconds = 100;
  rig.render("w");
  EXPECT_DOUBLE_EQ(credible(100), 0);
  // The units of the job took 3 + 2 + 1 s for 3 of them; one that is not leased is taken to cost the mean of
  // such units, since its worker may have been told to stop.
  EXPECT_LE(rig.farm.believable_seconds({{"j"}, 99, 0}, {"w"}, 1e6, rig.now), 3);
}

}  // namespace
}  // namespace ls::coordinator
