#include "cli/scale/costs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace ls::cli {
namespace {

using nlohmann::json;
using testing::HasSubstr;

struct Report {
  std::vector<JobCost> jobs;
  std::vector<WorkerCost> workers;
};

void observe(Spending& spending, const Report& report) { spending.observe(report.jobs, report.workers); }

TEST(Spending, CountsFromTheFirstReportOn) {
  Spending spending;
  observe(spending, {{{"j-1", "fog", "ann", 100}}, {{"w-1", "slurm", 50}}});
  observe(spending, {{{"j-1", "fog", "ann", 130}, {"j-2", "bath", "bob", 20}},
                     {{"w-1", "slurm", 80}, {"w-2", "others", 20}}});

  EXPECT_DOUBLE_EQ(spending.of_job("j-1"), 30);
  EXPECT_DOUBLE_EQ(spending.of_job("j-2"), 20);
  EXPECT_DOUBLE_EQ(spending.of_user("ann"), 30);
  const json report = spending.report();
  EXPECT_DOUBLE_EQ(report["by_job"]["j-2"]["core_hours"], 20 / kCoreHour);
  EXPECT_EQ(report["by_job"]["j-2"]["user"], "bob");
  EXPECT_EQ(report["by_job"]["j-2"]["name"], "bath");
  EXPECT_DOUBLE_EQ(report["by_user"]["ann"], 30 / kCoreHour);
  EXPECT_DOUBLE_EQ(report["by_engine"]["slurm"], 30 / kCoreHour);
  EXPECT_DOUBLE_EQ(report["by_engine"]["others"], 20 / kCoreHour);
}

TEST(Spending, KeepsWhatTheCoordinatorForgets) {
  Spending spending;
  observe(spending, {});
  observe(spending, {{{"j-1", "fog", "ann", 100}}, {{"w-1", "slurm", 100}}});
  observe(spending, {});
  observe(spending, {{{"j-2", "fog", "ann", 7}}, {{"w-1", "slurm", 107}}});

  EXPECT_DOUBLE_EQ(spending.of_user("ann"), 107);
  EXPECT_DOUBLE_EQ(spending.report()["by_engine"]["slurm"], 107 / kCoreHour) << "it was the same worker";
}

TEST(Spending, ResultsThatAreRenderedAgainAfterACrashAreNotCountedTwiceUntilTheyCostMore) {
  Spending spending;
  observe(spending, {});
  for (const double seconds : {100.0, 60.0, 90.0, 110.0})
    observe(spending, {{{"j-1", "fog", "ann", seconds}}, {}});

  EXPECT_DOUBLE_EQ(spending.of_job("j-1"), 110);
}

TEST(Spending, AWorkerThatWasStartedAgainGoesOnWithItsSum) {
  Spending spending;
  observe(spending, {{}, {{"w-1", "slurm", 40}}});
  for (const double seconds : {100.0, 3.0, 5.0}) observe(spending, {{}, {{"w-1", "slurm", seconds}}});

  EXPECT_DOUBLE_EQ(spending.report()["by_engine"]["slurm"], (60 + 5) / kCoreHour);
}

TEST(Spending, BudgetsHoldForEachJobForEachUserAndForNamedUsers) {
  Spending spending({.job = 50, .user = 80, .users = {{"ann", 200}, {"", 10}}});
  observe(spending, {});
  observe(
      spending,
      {{{"j-1", "", "ann", 50}, {"j-2", "", "ann", 10}, {"j-3", "", "bob", 30}, {"j-4", "", "", 10}}, {}});

  EXPECT_DOUBLE_EQ(spending.left_of_job("j-1"), 0);
  EXPECT_DOUBLE_EQ(spending.left_of_job("j-2"), 40);
  EXPECT_DOUBLE_EQ(spending.left_of_job("unheard of"), 50);
  EXPECT_DOUBLE_EQ(spending.left_of_user("ann"), 140);
  EXPECT_DOUBLE_EQ(spending.left_of_user("bob"), 50);
  EXPECT_DOUBLE_EQ(spending.left_of_user(""), 0);
  EXPECT_EQ(Spending().left_of_user("bob"), std::numeric_limits<double>::infinity());
}

TEST(Spending, RefusesAFileWithoutSums) {
  for (const json& bad : {json(), json::object(), json{{"jobs", 1}, {"workers", 2}},
                          json{{"jobs", {{"j-1", {{"before", 0}}}}}, {"workers", json::object()}},
                          json{{"jobs", json::object()}, {"workers", {{"w-1", 5}}}}})
    EXPECT_FALSE(Spending().go_on_from(bad)) << bad;
}

// Jobs and workers appear, end, restart and are forgotten by the coordinator, and `farm up` restarts from its
// file at any time. Every core second is counted once, and a user's sum is that of the user's jobs.
TEST(Spending, CountsEverySecondOnceWhateverHappens) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int percent) { return static_cast<int>(random() % 100) < percent; };
    Spending spending;
    observe(spending, {});
    std::map<std::string, JobCost> jobs;
    std::map<std::string, WorkerCost> workers;
    double rendered = 0;
    for (int step = 0; step < 400; ++step) {
      if (chance(10)) {
        const std::string id = "j-" + std::to_string(step);
        jobs[id] = {id, "fog", std::string(1, static_cast<char>('a' + random() % 3)), 0};
      }
      if (chance(10)) {
        const std::string id = "w-" + std::to_string(step);
        workers[id] = {id, chance(50) ? "slurm" : "others", 0};
      }
      for (auto& [id, worker] : workers) {
        if (chance(3)) worker.core_seconds = 0;
        if (jobs.empty()) continue;
        auto& job = std::next(jobs.begin(), static_cast<long>(random() % jobs.size()))->second;
        const double seconds = 1 + static_cast<double>(random() % 9);
        job.core_seconds += seconds, worker.core_seconds += seconds, rendered += seconds;
      }
      Report report;
      for (const auto& [id, job] : jobs) report.jobs.push_back(job);
      for (const auto& [id, worker] : workers) report.workers.push_back(worker);
      observe(spending, report);
      if (chance(20)) observe(spending, {});  // the coordinator has just restarted
      if (chance(5)) {
        Spending again;
        ASSERT_TRUE(again.go_on_from(spending.to_json()));
        spending = std::move(again);
      }
      if (chance(5) && !jobs.empty()) jobs.erase(jobs.begin());
    }
    const json report = spending.report();
    double by_job = 0, by_user = 0, by_engine = 0;
    for (const auto& [id, line] : report["by_job"].items()) by_job += line["core_hours"].get<double>();
    for (const auto& [user, hours] : report["by_user"].items()) by_user += hours.get<double>();
    for (const auto& [engine, hours] : report["by_engine"].items()) by_engine += hours.get<double>();
    // Sums of whole seconds are exact. Dividing each of some hundred sums by 3600 has a relative rounding
    // error of 2^-53.
    EXPECT_NEAR(by_job * kCoreHour, rendered, rendered * 1e-12) << "seed " << seed;
    EXPECT_NEAR(by_user * kCoreHour, rendered, rendered * 1e-12) << "seed " << seed;
    // If a worker restarts and renders at least as much as before until the next report, its restart is not
    // noticed. So the sum by engines may be too small, never too large.
    EXPECT_LE(by_engine * kCoreHour, rendered * (1 + 1e-12)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace ls::cli
