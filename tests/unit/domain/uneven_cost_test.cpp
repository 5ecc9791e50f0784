// Bounds that hold however wrongly costs are predicted: how long a lease lasts, when a job with a time limit
// ends, and how much of the farm each of several jobs gets. The costs of tiles differ by up to 10^6, and the
// first tiles are often the cheapest, as in a picture with the sky above.
#include <cmath>
#include <random>

#include "tests/unit/domain/clockwork.h"

namespace ls::coordinator {
namespace {

// A farm with jobs whose tiles have costs of their own. A unit of a tile costs the tile's cost per sample
// times its samples, within a factor `noise` up or down that differs from round to round.
struct Uneven {
  explicit Uneven(std::uint64_t seed) : random(seed) {}

  std::uint64_t pick(std::uint64_t n) { return random() % n; }
  double uniform(double from, double to) { return std::uniform_real_distribution(from, to)(random); }

  void workers(std::uint64_t count, int most_threads) {
    for (std::uint64_t i = 0; i < count; ++i) {
      const int n = 1 + static_cast<int>(pick(static_cast<std::uint64_t>(most_threads)));
      work.join("w" + std::to_string(i), n);
      threads += n;
    }
  }
  // Draws the costs of a job: per sample of a tile 10^-6 to 1 times `most` seconds; at least one tile has
  // `most`
  void costs(const std::string& job, int tiles, double most) {
    std::vector<double>& of_tile = per_sample[job];
    for (int t = 0; t < tiles; ++t) of_tile.push_back(most * std::pow(10, t == 0 ? 0 : uniform(-6, 0)));
    if (pick(3) > 0) std::sort(of_tile.begin(), of_tile.end());
    work.cost = [this](const UnitKey& unit) {
      std::mt19937_64 of_unit(unit.tile * 1000003 + unit.round);
      const double factor =
          std::exp(std::uniform_real_distribution(-std::log(noise), std::log(noise))(of_unit));
      const double cost = factor * per_sample.at(unit.job.value)[unit.tile] *
                          static_cast<double>(round_range(unit.round).count());
      longest = std::max(longest, cost);
      return cost;
    };
  }
  // Seconds that the first round of the job takes if the farm does nothing else
  double first_round(const std::string& job) {
    double sum = 0;
    for (const double c : per_sample.at(job)) sum += 2 * c;
    return sum / threads;
  }

  std::mt19937_64 random;
  Clockwork work;
  double threads = 0, noise = 1.5;
  double longest = 0;  // seconds that the longest unit so far has taken
  std::map<std::string, std::vector<double>> per_sample;
};

TEST(UnevenCosts, LeaseLastsAtMostItsSecondsPlusOneUnit) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Uneven farm(seed);
    farm.workers(1 + farm.pick(3), 4);
    for (std::uint64_t j = 0; j <= farm.pick(2); ++j) {
      const std::string id = "j" + std::to_string(j);
      const int tiles = 1 + static_cast<int>(farm.pick(300));
      farm.costs(id, tiles, farm.uniform(.001, .05));
      farm.work.rig.submit(plan_of(id, tiles, std::nullopt));
    }

    farm.work.run(60);

    ASSERT_EQ(audit(farm.work.rig.farm), "");
    for (const auto& [id, lease] : farm.work.leases)
      ASSERT_LE(lease.ended - lease.begun, kLeaseLimit + lease.longest + 1e-6)
          << id.value << ", seed " << seed;
  }
}

TEST(UnevenCosts, JobByTimeEndsWithinOneUnitOfItsLimit) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Uneven farm(seed);
    farm.workers(1, 8);
    const int tiles = 1 + static_cast<int>(farm.pick(300));
    // The dearest tile has 65,536 samples: more than all threads could render until the limit
    farm.costs("j", tiles, farm.uniform(.005, .02));
    JobPlan plan = plan_of("j", tiles, std::nullopt);
    plan.time = std::max(3.0, 2 * farm.first_round("j")) + farm.uniform(0, 20);
    farm.work.rig.submit(plan);

    farm.work.run(200);

    ASSERT_TRUE(farm.work.finished.contains("j")) << "seed " << seed;
    EXPECT_EQ(farm.work.rig.job().stopped, StopReason::time);
    EXPECT_NEAR(farm.work.finished["j"], *plan.time, farm.longest + 1e-6) << "seed " << seed;
  }
}

// Workers give back what they have not begun while others are rendering later rounds of the same tiles.
TEST(UnevenCosts, JobByTimeEndsWithinOneUnitOfItsLimitOnManyWorkers) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Uneven farm(seed);
    farm.workers(2 + farm.pick(4), 4);
    const int tiles = 1 + static_cast<int>(farm.pick(300));
    farm.costs("j", tiles, farm.uniform(.005, .02));
    JobPlan plan = plan_of("j", tiles, std::nullopt);
    plan.time = std::max(3.0, 2 * farm.first_round("j")) + farm.uniform(0, 20);
    farm.work.rig.submit(plan);

    farm.work.run(200);

    ASSERT_TRUE(farm.work.finished.contains("j")) << "seed " << seed;
    EXPECT_NEAR(farm.work.finished["j"], *plan.time, farm.longest + 1e-6) << "seed " << seed;
  }
}

// Two jobs of equal priority, one of them with costs that nobody can predict.
TEST(UnevenCosts, EqualJobsGetEqualSecondsWithinALease) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Uneven farm(seed);
    farm.workers(1 + farm.pick(3), 4);
    for (const char* id : {"a", "b"}) {
      const int tiles = 20 + static_cast<int>(farm.pick(300));
      farm.costs(id, tiles, farm.uniform(.005, .05));
      JobPlan plan = plan_of(id, tiles, std::nullopt);
      plan.owner = id;
      farm.work.rig.submit(plan);
    }

    farm.work.run(120);

    // A worker may have one lease of one of them at hand, and the preference for loaded worlds counts.
    const double bound = farm.threads * (kLeaseLimit + farm.longest + kLocalitySeconds);
    EXPECT_NEAR(farm.work.seconds["a"], farm.work.seconds["b"], bound) << "seed " << seed;
    EXPECT_GT(farm.work.seconds["a"] + farm.work.seconds["b"], 110 * farm.threads) << "seed " << seed;
  }
}

// A user pauses the job, or stops it, while a worker holds hundreds of units that each take far longer than
// predicted.
TEST(UnevenCosts, PausedOrStoppedJobEndsAfterItsStartedUnits) {
  for (const bool pause : {true, false}) {
    Clockwork work;
    work.join("w", 2);
    // The first rounds cost nothing, and then each unit takes a second
    work.cost = [](const UnitKey& unit) { return unit.round < 4 ? 1e-6 : 1.; };
    work.rig.submit(plan_of("j", 100, std::nullopt));
    work.run(.5);
    const std::size_t held = work.rig.held[{"w"}].size();
    ASSERT_GT(held, 100u);
    const double before = work.seconds["j"];

    work.send(pause ? Event(JobPaused{{"j"}}) : Event(JobStopped{{"j"}}));
    work.run(100);

    EXPECT_LE(work.seconds["j"] - before, 2 * 1. + 1e-3) << "the two units that were being rendered";
    EXPECT_EQ(work.rig.job().state, pause ? JobState::paused : JobState::done);
    EXPECT_EQ(work.rig.job().units_leased, 0u);
    EXPECT_EQ(audit(work.rig.farm), "");
  }
}

// A worker is lost with hundreds of units of a job whose time is up: only those that it may have begun are
// rendered again.
TEST(UnevenCosts, UnstartedUnitsOfALostWorkerAreNotRenderedAfterTheTimeLimit) {
  Rig rig;
  rig.own_time = true;
  rig.cpu_seconds = 1e-6;
  rig.join("w", 2);
  JobPlan plan = plan_of("j", 100, std::nullopt);
  plan.time = 1;
  rig.submit(plan);
  while (rig.job().units_done < 150) rig.now += 1us, rig.render("w");
  ASSERT_GT(rig.worker("w").units_out, 100u);
  EXPECT_FALSE(sent<RecallLease>(rig.pass(2s)).empty());

  rig.lose("w");

  EXPECT_LE(rig.job().units_total - rig.job().units_done, 2u) << "its two threads may have begun two units";
  rig.cpu_seconds = 1;
  rig.join("v", 1);
  rig.render_all();

  EXPECT_EQ(rig.job().state, JobState::done);
  EXPECT_EQ(rig.job().stopped, StopReason::time);
}

}  // namespace
}  // namespace ls::coordinator
