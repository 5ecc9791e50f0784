// Audits, and how a worker that rendered wrong pixels, and its results, are treated.
#include "tests/unit/domain/clockwork.h"

namespace ls::coordinator {
namespace {

Farm::Options audited_farm(double rate) {
  return {.lease_prefix = "t", .limits = {}, .audit_rate = rate, .audit_seed = 7};
}

bool all_honest(const Clockwork& work, const JobPlan& plan) {
  const std::uint64_t rounds = round_count(*plan.spp);
  std::uint64_t right = 0;
  for (const auto& [unit, digest] : work.accepted)
    right += unit.job == plan.brief.job && digest == honest(unit, cut_range(unit.round, *plan.spp));
  return right == rounds * plan.grid.count();
}

// Returns a function that gives wrong pixels for every unit of the workers in `who`.
auto liars(std::set<std::string> who) {
  return [who = std::move(who)](const std::string& worker, const UnitKey& unit, const SampleRange& range) {
    return who.contains(worker)
               ? digest_number(std::hash<std::string>{}(worker) ^ range.s1 ^ (unit.tile << 8))
               : honest(unit, range);
  };
}

TEST(Audit, AnyResultCanBeAuditedBeforeTheJobEnds) {
  Clockwork work(audited_farm(1));
  for (const char* name : {"a", "b", "c"}) work.join(name, 1);
  const JobPlan plan = plan_of("j", 20, 4);
  work.rig.submit(plan);

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  const AuditFigures figures = work.rig.farm.audits();
  EXPECT_EQ(figures.asked, 40u);
  EXPECT_EQ(figures.equal, 40u);
  EXPECT_EQ(figures.differ + figures.dropped, 0u);
  EXPECT_TRUE(all_honest(work, plan));
  EXPECT_EQ(work.seconds["j"], 80 * .5);
}

TEST(Audit, AuditsTheRequestedShareOfResults) {
  Clockwork work(audited_farm(.01));
  for (const char* name : {"a", "b", "c"}) work.join(name, 4);
  work.rig.submit(plan_of("j", 5000, 4));

  work.run();

  // With 10,000 draws at 1 %, six standard deviations are 60.
  EXPECT_NEAR(static_cast<double>(work.rig.farm.audits().asked), 100, 60);
  EXPECT_EQ(work.rig.farm.audits().equal, work.rig.farm.audits().asked);
}

// Returns the audits that the first `results` results of "a" begin, while "b" does nothing.
std::vector<JobRestored::Audit> opened(Farm::Options options, int results) {
  Rig rig(plan_of("j", 200, 2), {{"a", 1}, {"b", 1}}, std::move(options));
  for (int i = 0; i < results; ++i) rig.render("a");
  return rig.farm.open_audits({"j"});
}

TEST(Audit, NumberOfAuditsPerJobIsBounded) {
  EXPECT_EQ(opened(audited_farm(1), kMaxAuditsOpen + 20).size(), kMaxAuditsOpen);
}

// A worker that could predict which units are audited could deliver wrong pixels for all others.
TEST(Audit, ChoosesUnitsByASecretSeed) {
  Farm::Options one = audited_farm(.5), other = one;
  other.audit_seed = one.audit_seed + 1;
  EXPECT_EQ(opened(one, 40), opened(one, 40));
  EXPECT_NE(opened(one, 40), opened(other, 40));
}

TEST(Audit, LoneWorkerIsNotAudited) {
  Clockwork work(plan_of("j", 20, 4), {{"a", 2}}, audited_farm(1));

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  EXPECT_EQ(work.rig.farm.audits().asked, 0u);
}

TEST(Audit, AuditIsDroppedIfNoOtherWorkerIsLeftAndTheJobEnds) {
  Clockwork work(plan_of("j", 20, 4), {{"a", 1}, {"b", 1}}, audited_farm(1));
  work.run(3);
  work.rig.lose("b");

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  EXPECT_GT(work.rig.farm.audits().dropped, 0u);
}

// The job of a coordinator that dies while the audit of one accepted result of "a" is open, as it is
// restored.
JobRestored restored(Digest accepted, JobRestored::Audit audit, int tiles = 6) {
  JobRestored event;
  event.plan = plan_of("j", tiles, 2);
  event.state = JobState::running;
  event.numeric_class = digest_number(1);
  event.accepted = {{audit.tile, audit.round, {0, 2}, accepted, {"a"}}};
  event.audits = {std::move(audit)};
  return event;
}
const Digest kRight = honest({{"j"}, 0, 0}, {0, 2}), kWrong = digest_number(5);

TEST(Audit, RunningAuditIsListedUntilItIsDecided) {
  Rig rig(plan_of("j", 6, 2), {{"a", 1}, {"b", 1}}, audited_farm(1));
  EXPECT_TRUE(rig.farm.take_changed_audits().empty());

  const Rig::Held unit = rig.take("a");
  rig.result("a", unit);

  EXPECT_EQ(rig.farm.take_changed_audits(), std::vector<JobId>{{"j"}});
  const std::vector<JobRestored::Audit> open{{unit.unit.tile, unit.unit.round, std::nullopt}};
  EXPECT_EQ(rig.farm.open_audits({"j"}), open);
  rig.render_all();
  EXPECT_EQ(rig.farm.take_changed_audits(), std::vector<JobId>{{"j"}});
  EXPECT_TRUE(rig.farm.open_audits({"j"}).empty());
}

TEST(Audit, ContinuesAfterARestart) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, std::nullopt}));
  rig.pass(1s);  // no worker has connected again yet
  rig.join("a", 1);
  rig.join("b", 1);

  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.farm.audits().equal, 1u);
}

TEST(Audit, HeldJobRendersOnlyItsAudits) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, std::nullopt}));
  rig.send(JobHeld{{"j"}, true});
  rig.join("a", 1);
  rig.join("b", 1);

  ASSERT_EQ(rig.held[{"b"}].size(), 1u);
  EXPECT_EQ(rig.held[{"b"}].front().key(), (UnitKey{{"j"}, 0, 0}));
  EXPECT_TRUE(rig.held[{"a"}].empty());

  rig.send(JobHeld{{"j"}, false});
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Audit, LosingItsWorkerEndsTheAuditsLease) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, std::nullopt}));
  rig.join("a", 1);
  rig.join("b", 1);
  const UnitKey audited{{"j"}, 0, 0};
  const auto of_b = rig.held[{"b"}];
  const auto asked =
      std::find_if(of_b.begin(), of_b.end(), [&](const Rig::Held& h) { return h.key() == audited; });
  ASSERT_NE(asked, of_b.end());

  const auto freed = of<UnitsFreed>(rig.lose("b"));

  EXPECT_TRUE(std::any_of(freed.begin(), freed.end(), [&](const UnitsFreed& f) {
    return f.audit && f.lease == asked->lease && f.units == std::vector{audited};
  }));
}

TEST(Audit, AuditOfAResultWithoutADigestAccusesNobody) {
  Rig rig(audited_farm(0));
  rig.send(restored(Digest{}, {0, 0, std::nullopt}));
  rig.join("a", 1);
  rig.join("b", 1);

  const auto effects = rig.render_all();

  EXPECT_TRUE(of<DigestMismatch>(effects).empty());
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Audit, UnrequestedResultDoesNotEndAnAudit) {
  Rig rig(plan_of("j", 6, 2), {{"a", 1}}, audited_farm(1));
  rig.join("b", 1);
  rig.join("c", 1);
  const Rig::Held unit = rig.take("a");
  rig.result("a", unit);
  const auto& of_b = rig.held[{"b"}];
  const bool b_is_asked =
      std::any_of(of_b.begin(), of_b.end(), [&](const Rig::Held& h) { return h.key() == unit.key(); });

  rig.result(b_is_asked ? "c" : "b", unit);

  EXPECT_EQ(rig.farm.open_audits({"j"}).size(), 1u);
  EXPECT_EQ(rig.farm.audits().equal, 0u);
}

TEST(Audit, IgnoresTheResultOfAQuarantinedWorker) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, {{{"b"}, kWrong}}}));
  rig.join("a", 1);
  rig.join("c", 1);

  rig.send(WorkerQuarantined{{"b"}, "found out elsewhere"});

  EXPECT_TRUE(rig.farm.open_audits({"j"}).empty());
}

TEST(FaultyWorker, CheckpointWithItsPixelsIsMadeAgain) {
  Rig rig(plan_of("j", 2, 6), {{"a", 1}}, audited_farm(0));
  rig.render("a");
  ASSERT_EQ(of<Checkpoint>(rig.render("a")).size(), 1u);

  rig.send(WorkerQuarantined{{"a"}, "found out elsewhere"});
  rig.join("b", 1);
  const auto effects = rig.render_all();

  ASSERT_FALSE(of<Checkpoint>(effects).empty());
  EXPECT_EQ(of<Checkpoint>(effects)[0].spp, 2);
}

TEST(Audit, WrongResultFromBeforeTheRestartIsFound) {
  Rig rig(audited_farm(0));
  rig.send(restored(kWrong, {0, 0, std::nullopt}));
  for (const char* name : {"a", "b", "c"}) rig.join(name, 1);

  const auto effects = rig.render_all();

  ASSERT_EQ(of<WorkerFoundFaulty>(effects).size(), 1u);
  EXPECT_EQ(of<WorkerFoundFaulty>(effects)[0].worker.value, "a");
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Audit, SecondResultFromBeforeTheRestartStillCounts) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, {{{"b"}, kWrong}}}));
  for (const char* name : {"a", "b"}) rig.join(name, 1);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::running) << "a third one has to decide";
  rig.join("c", 1);

  const auto effects = rig.render_all();

  ASSERT_EQ(of<WorkerFoundFaulty>(effects).size(), 1u);
  EXPECT_EQ(of<WorkerFoundFaulty>(effects)[0].worker.value, "b");
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(Audit, DropsAnOldAuditIfNobodyReturnsForIt) {
  Rig rig(audited_farm(0));
  rig.send(restored(kRight, {0, 0, std::nullopt}, 1));
  rig.pass(kAuditAfterRestart - 1s);
  EXPECT_EQ(rig.job().state, JobState::running);

  rig.pass(2s);

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.farm.audits().dropped, 1u);
}

TEST(Audit, AuditOfAnUnacceptedResultIsDroppedAfterARestart) {
  Rig rig(audited_farm(0));
  JobRestored event = restored(kRight, {0, 0, std::nullopt});
  event.audits = {{1, 0, std::nullopt}, {7, 0, std::nullopt}, {0, 9, std::nullopt}};
  rig.send(event);

  EXPECT_TRUE(rig.farm.open_audits({"j"}).empty());
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(FaultyWorker, ThirdWorkerExposesItAndItsTilesAreRenderedAgain) {
  Clockwork work(audited_farm(.01));
  for (int i = 0; i < 8; ++i) work.join("w" + std::to_string(i), 2);
  work.pixels = liars({"w3"});
  const JobPlan plan = plan_of("j", 400, 64);
  work.rig.submit(plan);

  work.run();

  EXPECT_EQ(work.rig.job().state, JobState::done);
  EXPECT_TRUE(all_honest(work, plan));
  const auto found = work.seen<WorkerFoundFaulty>();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].worker.value, "w3");
  EXPECT_THAT(found[0].evidence, testing::HasSubstr("both rendered it to"));
  EXPECT_FALSE(work.seen<TileDiscarded>().empty());
  EXPECT_TRUE(work.rig.farm.quarantined({"w3"}));
  EXPECT_EQ(work.rig.worker("w3").state, WorkerState::unhealthy);
  EXPECT_TRUE(work.rig.held[{"w3"}].empty());
  EXPECT_EQ(work.rig.farm.audits().workers_quarantined, 1u);
}

// Takes the unit from the worker that audits it, and returns the worker's name.
std::string asked(Rig& rig, const UnitKey& unit) {
  for (auto& [id, units] : rig.held)
    for (auto it = units.begin(); it != units.end(); ++it)
      if (it->key() == unit) {
        units.erase(it);
        return id.value;
      }
  return "nobody";
}

std::vector<Effect> says(Rig& rig, const Rig::Held& unit, const std::string& worker, const Digest& digest) {
  return rig.send(UnitAccepted{unit.key(), unit.unit.samples, digest, {worker}, .1});
}

TEST(FaultyWorker, IsFoundRegardlessOfTheOrderOfResults) {
  for (const bool lies_first : {false, true}) {
    Rig rig(audited_farm(1));
    for (const char* name : {"a", "b", "c"}) rig.join(name, 1);
    rig.submit(plan_of("j", 6, 2));
    const Rig::Held unit = rig.take("a");
    const Digest truth = honest(unit.key(), unit.unit.samples), lie = digest_number(666);
    says(rig, unit, "a", lies_first ? lie : truth);
    const std::string second = asked(rig, unit.key());
    const auto mismatch = says(rig, unit, second, lies_first ? truth : lie);
    EXPECT_EQ(of<DigestMismatch>(mismatch).size(), 1u);
    EXPECT_EQ(rig.job().state, JobState::running) << "a third worker is asked";

    const auto verdict = says(rig, unit, asked(rig, unit.key()), truth);

    ASSERT_EQ(of<WorkerFoundFaulty>(verdict).size(), 1u);
    EXPECT_EQ(of<WorkerFoundFaulty>(verdict)[0].worker.value, lies_first ? "a" : second);
    EXPECT_EQ(of<TileDiscarded>(verdict).size(), lies_first ? 1u : 0u);
    rig.render_all();
    EXPECT_EQ(rig.job().state, JobState::done);
    EXPECT_EQ(audit(rig.farm), "");
  }
}

TEST(FaultyWorker, TwoUnrequestedVotersQuarantineNobodyAndAreFound) {
  Rig rig(audited_farm(0));
  for (const char* name : {"h", "c", "d", "x1", "x2"}) rig.join(name, 1);
  rig.submit(plan_of("j", 6, 2));
  const Rig::Held unit = rig.take("h");
  rig.result("h", unit);

  for (const char* faulty : {"x1", "x2"})
    EXPECT_TRUE(of<WorkerFoundFaulty>(says(rig, unit, faulty, digest_number(666))).empty()) << faulty;
  EXPECT_EQ(rig.job().state, JobState::running);
  const std::string third = asked(rig, unit.key());
  ASSERT_THAT(third, testing::AnyOf("c", "d")) << "not who accuses";

  const auto verdict = says(rig, unit, third, honest(unit.key(), unit.unit.samples));

  ASSERT_EQ(of<WorkerFoundFaulty>(verdict).size(), 1u);
  EXPECT_EQ(of<WorkerFoundFaulty>(verdict)[0].worker.value, "x1");
  EXPECT_FALSE(rig.farm.quarantined({"h"}));
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(audit(rig.farm), "");
}

TEST(FaultyWorker, UnrequestedResultAgainstTheOnlyOtherWorkerFailsNoJob) {
  Rig rig(audited_farm(0));
  for (const char* name : {"h", "x"}) rig.join(name, 1);
  rig.submit(plan_of("j", 6, 2));
  const Rig::Held unit = rig.take("h");
  rig.result("h", unit);

  says(rig, unit, "x", digest_number(666));

  EXPECT_EQ(rig.job().state, JobState::running);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(FaultyWorker, LateResultOfARequestedVoterCounts) {
  Rig rig(audited_farm(0));
  for (const char* name : {"h", "x", "c"}) rig.join(name, 1);
  rig.submit(plan_of("j", 3, 2));
  const Rig::Held unit = rig.take("x");
  rig.lose("x");  // its stream breaks, and another worker gets the unit
  rig.join("x", 1);
  const std::string other = asked(rig, unit.key());
  ASSERT_THAT(other, testing::AnyOf("h", "c"));
  rig.result(other, unit);

  says(rig, unit, "x", digest_number(666));
  const auto verdict = says(rig, unit, asked(rig, unit.key()), honest(unit.key(), unit.unit.samples));

  ASSERT_EQ(of<WorkerFoundFaulty>(verdict).size(), 1u);
  EXPECT_EQ(of<WorkerFoundFaulty>(verdict)[0].worker.value, "x");
  EXPECT_EQ(rig.farm.audits().asked, 1u);
  EXPECT_EQ(rig.farm.audits().differ, 1u);
}

TEST(FaultyWorker, WorkerFoundByAnotherCoordinatorLosesItsLeasesAndItsResults) {
  Rig rig(audited_farm(0));
  for (const char* name : {"a", "b"}) rig.join(name, 1);
  rig.submit(plan_of("j", 6, 2));
  const Rig::Held unit = rig.take("a");
  rig.result("a", unit);
  ASSERT_FALSE(rig.held[{"a"}].empty());

  const auto effects = rig.send(WorkerQuarantined{{"a"}, "it rendered wrong pixels of job x"});

  EXPECT_EQ(rig.worker("a").state, WorkerState::unhealthy);
  EXPECT_TRUE(rig.held[{"a"}].empty());
  ASSERT_EQ(of<TileDiscarded>(effects).size(), 1u);
  EXPECT_EQ(of<TileDiscarded>(effects)[0].tile, unit.unit.tile);
  EXPECT_EQ(audit(rig.farm), "");
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(FaultyWorker, WorkerThatContradictsItselfIsFoundWithoutAThird) {
  Rig rig(plan_of("j", 6, 2), {{"a", 1}, {"b", 1}}, audited_farm(0));
  const Rig::Held unit = rig.take("a");
  rig.result("a", unit);

  const auto effects = rig.send(UnitAccepted{unit.key(), unit.unit.samples, digest_number(5), {"a"}, .1});

  ASSERT_EQ(of<WorkerFoundFaulty>(effects).size(), 1u);
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(FaultyWorker, ThreeDifferentAnswersFailTheJob) {
  Rig rig(audited_farm(1));
  for (const char* name : {"a", "b", "c"}) rig.join(name, 1);
  rig.submit(plan_of("j", 6, 2));
  const Rig::Held unit = rig.take("a");
  rig.result("a", unit);
  says(rig, unit, asked(rig, unit.key()), digest_number(5));

  const auto effects = says(rig, unit, asked(rig, unit.key()), digest_number(6));

  ASSERT_EQ(of<JobFailed>(effects).size(), 1u);
  EXPECT_THAT(of<JobFailed>(effects)[0].error, testing::HasSubstr("no third one agrees"));
  EXPECT_TRUE(of<WorkerFoundFaulty>(effects).empty());
}

// A job comes from another coordinator that had found this worker faulty.
TEST(FaultyWorker, ConnectedWorkerGetsNoUnitsOnceItIsKnownToBeFaulty) {
  Rig rig(plan_of("j", 6, 2), {{"a", 1}, {"b", 1}}, audited_farm(0));
  ASSERT_GT(rig.worker("a").units_out, 0u);

  const auto effects = rig.send(WorkerQuarantined{{"a"}, "quarantined: it lied"});

  EXPECT_EQ(rig.worker("a").units_out, 0u);
  EXPECT_EQ(rig.worker("a").state, WorkerState::unhealthy);
  EXPECT_FALSE(of<WorkerStateChanged>(effects).empty());
  EXPECT_EQ(audit(rig.farm), "");
  rig.held.erase({"a"});
  rig.render_all();
  EXPECT_EQ(rig.job().state, JobState::done);
}

TEST(FaultyWorker, IsIgnoredAndGetsNoUnitsAfterARestart) {
  Rig rig(audited_farm(0));
  rig.send(WorkerQuarantined{{"a"}, "it rendered wrong pixels of job x"});
  rig.join("a", 1);
  rig.submit(plan_of("j", 6, 2));
  EXPECT_TRUE(rig.held[{"a"}].empty());
  EXPECT_EQ(rig.farm.why_waiting({"j"}), "a is quarantined, since it rendered wrong pixels");

  const auto effects = rig.send(UnitAccepted{{{"j"}, 0, 0}, {0, 2}, digest_number(1), {"a"}, .1});

  EXPECT_EQ(of<DropUnwanted>(effects).size(), 1u);
  EXPECT_TRUE(of<RecordUnit>(effects).empty());
  EXPECT_EQ(audit(rig.farm), "");
}

// Where each tile ends depends on the errors of all tiles, including those with wrong pixels: all begin
// again.
TEST(FaultyWorker, JobWithATargetEndsAsIfTheFaultyWorkerHadNotExisted) {
  const auto ends = [](bool with_faulty_worker) {
    Clockwork work(audited_farm(with_faulty_worker ? .05 : 0));
    for (int i = 0; i < 5; ++i) work.join("w" + std::to_string(i), 2);
    if (with_faulty_worker) work.pixels = liars({"w2"});
    JobPlan plan = plan_of("j", 4, 4096);
    plan.grid = {{4 * 32, 32}, 32};
    plan.target_error = 1 / 400.;
    work.rig.rel_error = [&](const UnitKey& unit) {
      const Digest& pixels = work.arrived.at(unit);
      const bool wrong = pixels != honest(unit, cut_range(unit.round, 4096));
      return (wrong ? 100. : 1. + unit.tile) * 3 * 1024 / static_cast<double>(round_range(unit.round).s1);
    };
    work.rig.submit(plan);
    work.run();
    EXPECT_EQ(work.rig.job().state, JobState::done);
    EXPECT_EQ(work.seen<WorkerFoundFaulty>().size(), with_faulty_worker ? 1u : 0u);
    std::vector<RoundIndex> rounds;
    for (TileIndex t = 0; t < 4; ++t) rounds.push_back(tile_figures(work.rig.farm, {"j"}, t)->rounds_folded);
    return rounds;
  };
  EXPECT_EQ(ends(true), ends(false));
}

}  // namespace
}  // namespace ls::coordinator
