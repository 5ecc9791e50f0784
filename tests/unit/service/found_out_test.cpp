// A worker is quarantined after checkpoints were taken of its wrong pixels: the figures of these checkpoints
// are dropped.
#include <gmock/gmock.h>

#include <algorithm>
#include <thread>

#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/moving_store.h"

namespace ls::coordinator {
namespace {

std::unique_ptr<Coordinator> open_with(std::shared_ptr<JobStore> store) {
  Coordinator::Options options;
  options.jobs = std::move(store);
  options.shared = true;
  options.audit_rate = 0;
  return Coordinator::open(std::move(options)).value();
}

template <class Condition>
bool eventually(Condition condition) {
  const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > patience) return false;
    std::this_thread::yield();
  }
  return true;
}

// Compares the jobs' figures of the last checkpoint: those that users see, and those of the report.
void expect_same_error(const Coordinator& a, const JobId& in_a, const Coordinator& b, const JobId& in_b) {
  const JobView x = a.job(in_a).value(), y = b.job(in_b).value();
  ASSERT_TRUE(x.error_now && y.error_now);
  EXPECT_EQ(x.error_now->relmse, y.error_now->relmse);
  EXPECT_EQ(x.error_now->rmse, y.error_now->rmse);
  EXPECT_EQ(x.few_hits, y.few_hits);
  EXPECT_EQ(a.convergence(in_a)->back().spp, b.convergence(in_b)->back().spp);
  EXPECT_EQ(report(a, in_a)["relmse"], a.convergence(in_a)->back().error.relmse);
}

std::pair<std::unique_ptr<Coordinator>, JobId> honestly(const JobSpec& spec) {
  auto coordinator = open_with(make_memory_job_store());
  const JobId job = submit(*coordinator, spec);
  EXPECT_TRUE(FakeFarm(*coordinator, 1).finish(job));
  return {std::move(coordinator), job};
}

// The parameter: true for a job with a target error, of which all tiles are discarded; false for a job with a
// number of samples, of which only the faulty worker's tiles are discarded.
struct FoundOutLate : ::testing::TestWithParam<bool> {
  JobSpec spec = [] {
    JobSpec to_a_target;
    to_a_target.spp = 512;
    if (GetParam()) to_a_target.target_error = .003;
    return to_a_target;
  }();
  std::shared_ptr<MovingStore> store = std::make_shared<MovingStore>();
  std::unique_ptr<Coordinator> coordinator = open_with(store);
};

// A worker that sends only the results that `renders` selects.
struct Slow {
  FakeFarm farm;
  explicit Slow(Coordinator& coordinator, std::function<bool(const UnitKey&)> renders)
      : farm(coordinator, 1) {
    farm.tamper = [renders = std::move(renders)](UnitResult r) {
      return renders(r.unit) ? std::vector{std::move(r)} : std::vector<UnitResult>{};
    };
  }
};

TEST_P(FoundOutLate, ReportsNothingAboutItsDiscardedPixels) {
  const JobId job = submit(*coordinator, spec);
  Slow(*coordinator, [](const UnitKey& unit) { return unit.tile == 0 && unit.round < 3; }).farm.run([&] {
    return coordinator->job(job)->units_done == 3;
  });
  Slow lying(*coordinator, [](const UnitKey& unit) { return unit.round < 4; });
  lying.farm.lies = [](int, const UnitResult&) { return true; };
  ASSERT_TRUE(lying.farm.run([&] { return coordinator->convergence(job)->size() >= 3; }));
  WorkerId faulty;
  for (const WorkerView& worker : coordinator->workers())
    if (worker.state == "connected") faulty = worker.id;

  store->will_tell({.quarantined = {{faulty, "it lied elsewhere"}}});
  coordinator->tick();

  EXPECT_TRUE(coordinator->convergence(job)->empty());
  EXPECT_FALSE(coordinator->job(job)->error_now);
  ASSERT_TRUE(FakeFarm(*coordinator, 1).finish(job));
  const auto [honest, twin] = honestly(spec);
  EXPECT_EQ(pixels(*coordinator, job), pixels(*honest, twin));
  expect_same_error(*coordinator, job, *honest, twin);
  const auto points = *coordinator->convergence(job), all = *honest->convergence(twin);
  for (const ConvergencePoint& p : points)
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const ConvergencePoint& q) {
      return p.spp == q.spp && p.error.relmse == q.error.relmse;
    })) << p.spp;
  EXPECT_TRUE(eventually([&] { return store->points(job)->size() == points.size(); }));
}

INSTANTIATE_TEST_SUITE_P(BySamplesAndToATarget, FoundOutLate, ::testing::Bool());

}  // namespace
}  // namespace ls::coordinator
