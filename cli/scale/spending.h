// Adds up the core seconds that each job and each user has cost, from the coordinator's reports, and compares
// them with the budgets. A pure state machine: it reads no clock and sends no requests.
#pragma once

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "common/base/error.h"

namespace ls::cli {

inline constexpr double kCoreHour = 3600;  // core seconds

// Upper limits in core seconds; nullopt: no limit.
struct Budgets {
  std::optional<double> job;            // for each job
  std::optional<double> user;           // for each user that `users` does not name
  std::map<std::string, double> users;  // for the users named; "": the administrator
};

struct JobCost {
  std::string id, name, owner;  // owner "": the administrator
  double core_seconds = 0;      // spent on rendering since the job was submitted
};

struct WorkerCost {
  std::string id, engine;
  double core_seconds = 0;  // spent on rendering since the worker was started
};

// Costs before the first report are not counted. A job or worker that the coordinator has forgotten keeps its
// most recent sum.
class Spending {
 public:
  explicit Spending(Budgets budgets = {}) : budgets_(std::move(budgets)) {}

  void observe(std::span<const JobCost> jobs, std::span<const WorkerCost> workers);

  double of_job(const std::string& id) const;
  double of_user(const std::string& owner) const;
  // Returns the core seconds that remain in the budget of a job or of a user: infinity without a budget; 0 or
  // less if it is used up.
  double left_of_job(const std::string& id) const;
  double left_of_user(const std::string& owner) const;

  nlohmann::json report() const;  // core hours by job, by user and by engine
  nlohmann::json to_json() const;
  // Continues the sums of an earlier run, from its to_json(). invalid_argument: `json` has no such sums.
  Result<void> go_on_from(const nlohmann::json& json);

 private:
  struct Job {
    std::string name, owner;
    double before = 0;  // core seconds at the first report, which are not counted
    double now = 0;
  };
  struct Worker {
    std::string engine;
    double earlier = 0;          // core seconds of earlier processes with the same id
    double before = 0, now = 0;  // as in Job, for the process that runs now
  };
  Budgets budgets_;
  bool begun_ = false;
  std::map<std::string, Job> jobs_;
  std::map<std::string, Worker> workers_;
};

}  // namespace ls::cli
