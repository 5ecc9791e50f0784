// The costs of `lightshaft farm up`, in core seconds. The sums are kept in a file, so that the next run with
// the same --name continues them. The classes are pure state machines: they read no clock and send no
// requests.
#pragma once

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "cli/scale/engine.h"

namespace ls::cli {

// Adds up the core seconds that workers have reserved at the engine (Slurm, ssh, Docker or Kubernetes).
class Ledger {
 public:
  // Adds the cost since the previous call, `elapsed` seconds ago. `workers` is the engine's present list. A
  // worker that is no longer in it is charged for all of `elapsed`, since the time of its end is unknown.
  void observe(std::span<const EngineWorker> workers, double elapsed);
  // Adds workers that the engine has just started, each with `cores` cores. One that the next list lacks has
  // run and ended in between, and is charged for all of that time.
  void started(std::span<const std::string> ids, int cores);
  double core_seconds() const;
  // Returns how many workers have started to run. A worker that the engine requeued and ran again counts
  // again.
  int started() const { return started_; }

  nlohmann::json to_json() const;
  static Result<Ledger> from_json(const nlohmann::json& json);

 private:
  struct Line {
    double seconds = 0;
    int cores = 1;
  };
  std::map<std::string, Line> running_;
  std::map<std::string, int> unlisted_;  // cores of workers that were started since the last list
  double ended_ = 0;                     // core seconds of workers that have ended
  int started_ = 0;
};

inline constexpr double kCoreHour = 3600;  // in core seconds

// Upper limits in core seconds; nullopt: no limit.
struct Budgets {
  std::optional<double> job;            // budget of each job
  std::optional<double> user;           // budget of each user that is not in `users`
  std::map<std::string, double> users;  // budgets by user name; "": the administrator
};

struct JobCost {
  std::string id, name, owner;  // owner "": the administrator
  double core_seconds = 0;      // spent on rendering since the job was submitted
};

struct WorkerCost {
  std::string id, engine;
  double core_seconds = 0;  // spent on rendering since the worker was started
};

// Adds up the core seconds that each job and each user has cost, from the coordinator's reports, and compares
// them with the budgets. Costs before the first report are not counted. A job or worker that the coordinator
// has forgotten keeps its most recent sum.
class Spending {
 public:
  explicit Spending(Budgets budgets = {}) : budgets_(std::move(budgets)) {}

  void observe(std::span<const JobCost> jobs, std::span<const WorkerCost> workers);

  double of_job(const std::string& id) const;
  double of_user(const std::string& owner) const;
  // Returns the core seconds that remain in the budget of a job or of a user: infinity without a budget; 0 or
  // less if the budget is used up.
  double left_of_job(const std::string& id) const;
  double left_of_user(const std::string& owner) const;

  nlohmann::json report() const;  // core hours by job, by user and by engine
  nlohmann::json to_json() const;
  // Continues the sums of an earlier run, from its to_json(). invalid_argument: `json` does not contain sums.
  Result<void> go_on_from(const nlohmann::json& json);

 private:
  struct Job {
    std::string name, owner;
    double before = 0;  // core seconds before the first observe(), which are not counted
    double now = 0;
  };
  struct Worker {
    std::string engine;
    double earlier = 0;          // core seconds of earlier processes with the same id
    double before = 0, now = 0;  // as in Job, but only of the process that runs now
  };
  Budgets budgets_;
  bool begun_ = false;
  std::map<std::string, Job> jobs_;
  std::map<std::string, Worker> workers_;
};

}  // namespace ls::cli
