// Adds up what the workers of `lightshaft farm up` cost, in core seconds reserved at the engine (Slurm, ssh,
// Docker or Kubernetes). The sum is kept in a file, so the next run under the same name continues it instead
// of starting from 0.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "cli/scale/engine.h"

namespace ls::cli {

class Ledger {
 public:
  // Adds the cost since the previous call, `elapsed` seconds ago. `workers` is the engine's present list. A
  // worker that is no longer in it is charged for all of `elapsed`, since the time of its end is unknown.
  void observe(std::span<const EngineWorker> workers, double elapsed);
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
  double ended_ = 0;  // core seconds of workers that have ended
  int started_ = 0;
};

}  // namespace ls::cli
