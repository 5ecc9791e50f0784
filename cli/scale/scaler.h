// Decides how many workers `lightshaft farm up` should have on an engine (Slurm, ssh, Docker or Kubernetes).
// It reads no clock and starts nothing: its inputs are demand, workers and time, its outputs are actions. To
// *drain* a worker is to ask it to deliver its results and end.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "cli/scale/engine.h"
#include "common/base/clock.h"

namespace ls::cli {

// The coordinator's open work and its workers, as its HTTP interface reports them.
struct Demand {
  int open_jobs = 0;    // queued or running, with something left of their budgets
  int unpaid_jobs = 0;  // queued or running, but nothing is left of their budgets
  // Predicted cost of the work that no worker holds, as far as the budgets pay for it. The work of a job
  // counts as 0 until workers have measured its cost.
  double queued_core_seconds = 0;
  bool more_helps = true;        // false: by the coordinator's forecast, more workers would save no time
  int other_threads = 0;         // threads of connected workers that this command did not start
  std::set<std::string> joined;  // names of connected workers
  std::set<std::string> idle;    // names of the connected workers that hold no work
};

struct ScaleLimits {
  std::string farm;
  int most_workers = 1;
  int threads = 1;             // threads of each worker
  double finish_in = 600;      // seconds in which the queued work should be rendered
  double idle_seconds = 60;    // a worker without work is drained after this time
  double drain_seconds = 120;  // a draining worker that has not ended after this time is killed
  double poll_seconds = 5;     // seconds between two checks
  std::optional<double> budget_core_seconds;
};

struct ScaleActions {
  int start = 0;
  std::vector<EngineWorker> drain, kill;
  std::string why;  // the reason, shown to the user; empty: there is nothing to report
};

class Scaler {
 public:
  explicit Scaler(ScaleLimits limits) : limits_(std::move(limits)) {}

  // `spent`: core seconds that our workers have cost so far. `workers`: all workers that the engine lists.
  ScaleActions decide(const Demand& demand, std::span<const EngineWorker> workers, double spent,
                      TimePoint now);
  // Returns the actions while the command is ending: start no worker, drain all, and kill those that have not
  // ended after drain_seconds.
  ScaleActions end(std::span<const EngineWorker> workers, TimePoint now);
  // Must be called with the workers that the engine has started: one that the next list lacks has ended.
  void started(std::span<const std::string> ids);
  // Must be called if the engine could not start workers. The next attempt is delayed, longer after each
  // failure.
  void start_failed(TimePoint now);
  // Must be called if the engine could not ask these workers to drain. The request will be repeated.
  void drain_failed(std::span<const EngineWorker> workers);

  // A worker is started only if it can run for at least this many seconds within the budget.
  static constexpr double kWorthStarting = 60;
  // After a failed start, seconds until the next attempt: kFirstPause after the first failure, doubled by
  // each further failure, at most kLongestPause.
  static constexpr double kFirstPause = 5, kLongestPause = 600;

 private:
  struct Seen {
    bool joined = false;
    std::optional<TimePoint> idle_since;
    std::optional<TimePoint> draining_since;
  };
  void observe(const Demand& demand, std::span<const EngineWorker> workers, TimePoint now);
  int wanted(const Demand& demand) const;
  double seconds_to_end() const;
  int affordable(std::span<const EngineWorker> workers, double spent) const;
  void drain(const EngineWorker& worker, ScaleActions& out, TimePoint now);
  void kill_overdue(std::span<const EngineWorker> workers, ScaleActions& out, TimePoint now);

  ScaleLimits limits_;
  std::map<std::string, Seen> seen_;
  int failures_ = 0;
  std::optional<TimePoint> no_start_before_;
};

}  // namespace ls::cli
