#include "cli/scale/scaler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "cli/scale/costs.h"
#include "tests/support/fake_clock.h"

namespace ls::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Kind = EngineWorker::State;

// A scaler with a fake clock; the test sets the demand and the engine's list of workers.
struct World {
  ScaleLimits limits{.farm = "f", .most_workers = 8, .threads = 2, .finish_in = 100};
  Scaler scaler{limits};
  FakeClock clock;
  Demand demand;
  std::vector<EngineWorker> workers;
  double spent = 0;

  explicit World(ScaleLimits l) : limits(l), scaler(l) {}
  World() = default;

  ScaleActions look() { return scaler.decide(demand, workers, spent, clock.now()); }
  ScaleActions look_after(double seconds) {
    clock.advance(from_seconds(seconds));
    return look();
  }
  void work(double core_seconds) {
    demand.open_jobs = 1;
    demand.queued_core_seconds = core_seconds;
  }
  void no_work() {
    demand.open_jobs = 0;
    demand.queued_core_seconds = 0;
  }
  void run(const std::string& id, bool idle = false) {
    workers.push_back({id, Kind::running, 10, limits.threads});
    demand.joined.insert("f-" + id);
    if (idle) demand.idle.insert("f-" + id);
  }
};

std::vector<std::string> ids(const std::vector<EngineWorker>& workers) {
  std::vector<std::string> all;
  for (const auto& w : workers) all.push_back(w.id);
  return all;
}

TEST(Scaler, StartsNothingWithoutJobs) { EXPECT_EQ(World().look().start, 0); }

TEST(Scaler, StartsAsManyWorkersAsFinishTheQueueInTime) {
  World w;
  w.work(900);  // 9 threads for 100 s: 5 workers of 2 threads

  EXPECT_EQ(w.look().start, 5);
}

TEST(Scaler, StartsOneWorkerForAJobWhoseCostIsUnknown) {
  World w;
  w.work(0);

  EXPECT_EQ(w.look().start, 1);
}

TEST(Scaler, StartsNoMoreThanItMay) {
  World w;
  w.work(1e9);

  EXPECT_EQ(w.look().start, 8);
}

TEST(Scaler, CountsWorkersThatWaitAndThoseOfOthers) {
  World w;
  w.work(900);
  w.demand.other_threads = 3;  // of 9 threads, 6 are left: 3 workers
  w.run("1");
  w.workers.push_back({"2", Kind::waiting, 0, 2});

  EXPECT_EQ(w.look().start, 1);
}

TEST(Scaler, StartsNoMoreWhereTheForecastSaysThatMoreDoNotHelp) {
  World w;
  w.work(900);
  w.demand.more_helps = false;

  EXPECT_EQ(w.look().start, 1);

  w.run("1");
  EXPECT_EQ(w.look().start, 0);
}

TEST(Scaler, DrainsIdleWorkersAfterAWhileDownToNone) {
  World w;
  w.no_work();
  w.run("1", true);
  w.run("2", true);

  EXPECT_THAT(w.look().drain, IsEmpty());
  EXPECT_THAT(w.look_after(59).drain, IsEmpty());
  EXPECT_THAT(ids(w.look_after(1).drain), ElementsAre("1", "2"));
  EXPECT_THAT(w.look_after(1).drain, IsEmpty()) << "asked once";
}

TEST(Scaler, AWorkerThatGotWorkBetweenBeginsToWaitAnew) {
  World w;
  w.no_work();
  w.run("1", true);
  w.look();
  w.demand.idle.clear();
  w.look_after(50);
  w.demand.idle.insert("f-1");

  EXPECT_THAT(w.look_after(20).drain, IsEmpty());
  EXPECT_THAT(ids(w.look_after(60).drain), ElementsAre("1"));
}

TEST(Scaler, DoesNotDrainABusyWorkerBecauseTheQueueIsShorter) {
  World w;
  w.work(100);
  w.run("1");
  w.run("2");
  w.look();

  EXPECT_THAT(w.look_after(1000).drain, IsEmpty());
}

TEST(Scaler, WithdrawsWorkersThatStillWaitWhenTheQueueIsShorter) {
  World w;
  w.work(100);
  w.run("1");
  w.workers.push_back({"2", Kind::waiting, 0, 2});

  EXPECT_THAT(ids(w.look().drain), ElementsAre("2"));
}

TEST(Scaler, EndsAWorkerThatDoesNotDrain) {
  World w;
  w.run("1", true);
  w.look();
  w.look_after(60);

  EXPECT_THAT(w.look_after(119).kill, IsEmpty());
  EXPECT_THAT(ids(w.look_after(1).kill), ElementsAre("1"));
}

TEST(Scaler, AsksAgainForADrainThatTheEngineDidNotPassOn) {
  World w;
  w.run("1", true);
  w.look();
  const auto asked = w.look_after(60);
  w.scaler.drain_failed(asked.drain);

  EXPECT_THAT(ids(w.look_after(5).drain), ElementsAre("1"));
}

TEST(Scaler, WaitsBeforeItReplacesAWorkerThatTheEngineNeverStarted) {
  World w;
  w.work(100);
  w.workers.push_back({"1", Kind::stuck, 0, 2});

  const auto actions = w.look();

  EXPECT_THAT(ids(actions.drain), ElementsAre("1"));
  EXPECT_EQ(actions.start, 0);
  EXPECT_EQ(w.look_after(5).start, 1);
}

TEST(Scaler, ReplacesAWorkerAtOnceThatTheEngineDoesNotStartAgain) {
  World w;
  w.work(100);
  w.run("1");
  w.look();
  w.workers = {{"1", Kind::stuck, 0, 2}};
  w.demand.joined.clear();

  const auto actions = w.look();

  EXPECT_THAT(ids(actions.drain), ElementsAre("1"));
  EXPECT_EQ(actions.start, 1);
}

TEST(Scaler, WaitsLongerAfterEachWorkerThatEndedWithoutJoining) {
  World w;
  w.work(100);
  const auto fails = [&](const std::string& id) {
    w.workers.push_back({id, Kind::running, 1, 2});
    w.look();
    w.workers.clear();
  };

  fails("1");
  EXPECT_EQ(w.look().start, 0);
  EXPECT_EQ(w.look_after(5).start, 1);
  fails("2");
  EXPECT_EQ(w.look().start, 0);
  EXPECT_EQ(w.look_after(5).start, 0);
  EXPECT_THAT(w.look().why, HasSubstr("2 starts of workers in a row failed"));
  EXPECT_EQ(w.look_after(5).start, 1);
}

TEST(Scaler, WaitsAfterWorkersThatEndedBeforeTheyWereListed) {
  World w;
  w.work(100);
  w.look();
  const std::vector<std::string> ids{"1", "2"};
  w.scaler.started(ids);

  const auto actions = w.look();

  EXPECT_EQ(actions.start, 0);
  EXPECT_THAT(actions.why, HasSubstr("1 starts of workers in a row failed"));
  EXPECT_EQ(w.look_after(5).start, 1);
}

TEST(Scaler, ReplacesAWorkerThatHadJoinedAtOnce) {
  World w;
  w.work(100);
  w.run("1");
  w.look();
  w.workers.clear();  // its machine was lost
  w.demand.joined.clear();

  EXPECT_EQ(w.look().start, 1);
}

TEST(Scaler, StartsOnlyWhatTheBudgetLetsRun) {
  World w({.farm = "f",
           .most_workers = 8,
           .threads = 2,
           .finish_in = 100,
           .drain_seconds = 40,
           .budget_core_seconds = 500});  // each worker needs 2 x (60 + 40 + 2 x 5) of it
  w.work(1e6);

  EXPECT_EQ(w.look().start, 2);

  w.spent = 301;
  const auto none = w.look();
  EXPECT_EQ(none.start, 0);
  EXPECT_THAT(none.why, HasSubstr("the budget allows no more workers"));
}

TEST(Scaler, DrainsAllWhileTheBudgetStillPaysForIt) {
  World w({.farm = "f",
           .most_workers = 8,
           .threads = 2,
           .finish_in = 100,
           .drain_seconds = 40,
           .budget_core_seconds = 500});
  w.work(1e6);
  w.run("1");
  w.run("2");  // draining both takes 2 x 2 x (40 + 2 x 5) = 200 core seconds
  w.spent = 299;
  EXPECT_THAT(w.look().drain, IsEmpty());

  w.spent = 300;
  const auto actions = w.look();

  EXPECT_THAT(ids(actions.drain), ElementsAre("1", "2"));
  EXPECT_EQ(actions.start, 0);
}

TEST(Scaler, DrainsAllWhereNoOpenJobHasSomethingLeftOfItsBudget) {
  World w;
  w.work(1000);
  w.run("1");
  w.demand.unpaid_jobs = 1;
  EXPECT_THAT(w.look().drain, IsEmpty()) << "another job pays for it";

  w.no_work();
  const auto actions = w.look();

  EXPECT_THAT(ids(actions.drain), ElementsAre("1"));
  EXPECT_EQ(actions.start, 0);
  EXPECT_THAT(actions.why, HasSubstr("used up"));
}

TEST(Scaler, EndingDrainsAllAndStartsNothing) {
  World w;
  w.work(1e6);
  w.run("1");
  w.look();

  const auto actions = w.scaler.end(w.workers, w.clock.now());

  EXPECT_THAT(ids(actions.drain), ElementsAre("1"));
  EXPECT_EQ(actions.start, 0);
}

// The engine loses workers at random. There are never more workers than allowed, the cost stays within the
// budget, and all workers end when no jobs are left.
TEST(Scaler, KeepsItsLimitsWhateverTheEngineDoes) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int percent) { return static_cast<int>(random() % 100) < percent; };
    World w({.farm = "f",
             .most_workers = 5,
             .threads = 2,
             .finish_in = 100,
             .idle_seconds = 30,
             .drain_seconds = 40,
             .budget_core_seconds = 20'000});
    Ledger ledger;
    std::set<std::string> draining;
    int count = 0;
    const auto step = [&](double work) {
      w.clock.advance(from_seconds(5));
      work > 0 ? w.work(work) : w.no_work();
      w.demand.joined.clear(), w.demand.idle.clear();
      for (auto& worker : w.workers) {
        if (worker.state == Kind::running) worker.seconds += 5;
        if (worker.state == Kind::waiting && chance(50)) worker.state = Kind::running;
        if (worker.state == Kind::running && chance(2)) worker = {worker.id, Kind::waiting, 0, 2};
        if (worker.state != Kind::running) continue;
        w.demand.joined.insert("f-" + worker.id);
        if (work == 0) w.demand.idle.insert("f-" + worker.id);
      }
      std::erase_if(w.workers, [&](const auto& x) { return chance(draining.contains(x.id) ? 60 : 1); });
      ledger.observe(w.workers, 5);
      w.spent = ledger.core_seconds();
      const auto actions = w.look();
      for (const auto& x : actions.drain) draining.insert(x.id);
      for (const auto& x : actions.kill)
        std::erase_if(w.workers, [&](const auto& y) { return y.id == x.id; });
      for (int i = 0; i < actions.start; ++i)
        w.workers.push_back({std::to_string(++count), Kind::waiting, 0, 2});
      std::size_t alive = 0;
      for (const auto& x : w.workers) alive += !draining.contains(x.id);
      ASSERT_LE(alive, 5u) << "seed " << seed;
      ASSERT_LE(w.spent, 20'000) << "seed " << seed;
    };
    for (int i = 0; i < 600; ++i) step(chance(80) ? 5000 : 0);
    for (int i = 0; i < 60; ++i) step(0);
    EXPECT_THAT(w.workers, IsEmpty()) << "seed " << seed;
  }
}

EngineWorker running(const std::string& id, double seconds, int cores) {
  return {id, Kind::running, seconds, cores};
}

TEST(Ledger, SumsWhatWorkersReserve) {
  Ledger ledger;
  const std::vector<EngineWorker> both{running("1", 10, 4), running("2", 5, 1), {"3", Kind::waiting, 0, 4}};

  ledger.observe(both, 0);

  EXPECT_DOUBLE_EQ(ledger.core_seconds(), 45);
  EXPECT_EQ(ledger.started(), 2);
}

TEST(Ledger, AWorkerThatIsGoneIsChargedUpToTheLookThatMissedIt) {
  Ledger ledger;
  ledger.observe(std::vector{running("1", 10, 4)}, 0);

  ledger.observe({}, 5);

  EXPECT_DOUBLE_EQ(ledger.core_seconds(), 60);
}

TEST(Ledger, AWorkerThatEndedBeforeItWasListedIsChargedToo) {
  Ledger ledger;
  ledger.observe({}, 0);
  const std::vector<std::string> ids{"1", "2"};
  ledger.started(ids, 4);

  ledger.observe(std::vector{running("2", 3, 4)}, 5);

  EXPECT_DOUBLE_EQ(ledger.core_seconds(), 5 * 4 + 3 * 4);
  EXPECT_EQ(ledger.started(), 2);
}

TEST(Ledger, ARequeuedWorkerBeginsASecondRun) {
  Ledger ledger;
  ledger.observe(std::vector{running("1", 100, 1)}, 0);
  ledger.observe(std::vector{running("1", 3, 1)}, 5);

  EXPECT_DOUBLE_EQ(ledger.core_seconds(), 100 + 5 + 3);
  EXPECT_EQ(ledger.started(), 2);
}

TEST(Ledger, GoesOnFromItsFile) {
  Ledger ledger;
  ledger.observe(std::vector{running("1", 10, 2), running("2", 10, 1)}, 0);
  ledger.observe(std::vector{running("1", 20, 2)}, 10);

  auto again = Ledger::from_json(ledger.to_json());
  ASSERT_TRUE(again);
  again->observe(std::vector{running("1", 90, 2)}, 0);

  EXPECT_DOUBLE_EQ(again->core_seconds(), 90 * 2 + 20);
  EXPECT_EQ(again->started(), 2);
}

TEST(Ledger, RefusesAFileWithoutASum) { EXPECT_FALSE(Ledger::from_json({{"started", 2}})); }

}  // namespace
}  // namespace ls::cli
