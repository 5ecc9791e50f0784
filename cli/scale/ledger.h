// The cost of the workers of one farm-up, in core seconds that the engine reserved. It is stored in a file,
// so that a farm-up that is started again continues the sum.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "cli/scale/engine.h"

namespace ls::cli {

class Ledger {
 public:
  // Adds the cost since the last list of the engine. `elapsed` is the time in seconds since then. A worker
  // that has disappeared is charged for all of it, since its end was not observed.
  void observe(std::span<const EngineWorker> workers, double elapsed);
  double core_seconds() const;
  // Returns the number of workers that ran; a worker that was requeued counts again.
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
