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

// Core seconds; none: no limit.
struct Budgets {
  std::optional<double> job;            // of each job
  std::optional<double> user;           // of each user that `users` does not name
  std::map<std::string, double> users;  // "": the administrator
};

struct JobCost {
  std::string id, name, owner;  // owner "": the administrator
  double core_seconds = 0;      // rendered since the job was submitted
};

struct WorkerCost {
  std::string id, engine;
  double core_seconds = 0;  // rendered since it was started
};

// Everything counts from the first report on. A job or worker that the coordinator has forgotten keeps its
// last sum.
class Spending {
 public:
  explicit Spending(Budgets budgets = {}) : budgets_(std::move(budgets)) {}

  void observe(std::span<const JobCost> jobs, std::span<const WorkerCost> workers);

  double of_job(const std::string& id) const;
  double of_user(const std::string& owner) const;
  // Core seconds left in the budget of a job or of its owner. At or below 0 the budget is spent.
  double left_of_job(const std::string& id) const;
  double left_of_user(const std::string& owner) const;

  nlohmann::json report() const;  // core hours by job, by user and by engine
  nlohmann::json to_json() const;
  // Takes up the sums of an earlier run. invalid_argument: these are none.
  Result<void> go_on_from(const nlohmann::json& json);

 private:
  struct Job {
    std::string name, owner;
    double before = 0;  // rendered before the first report
    double now = 0;
  };
  struct Worker {
    std::string engine;
    double earlier = 0;          // rendered by earlier processes of the same id
    double before = 0, now = 0;  // as of a job
  };
  Budgets budgets_;
  bool begun_ = false;
  std::map<std::string, Job> jobs_;
  std::map<std::string, Worker> workers_;
};

}  // namespace ls::cli
