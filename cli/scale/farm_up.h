// `lightshaft farm up`: runs as many workers as a farm's jobs need, until the user stops it. An *engine*
// (Slurm, ssh, Docker or Kubernetes) starts and ends them.
#pragma once

#include <filesystem>

#include "cli/farm/farm_api.h"
#include "cli/output/interrupt.h"
#include "cli/scale/costs.h"
#include "cli/scale/engine.h"
#include "cli/scale/scaler.h"

namespace ls::cli {

struct FarmUpOptions {
  ScaleLimits limits;
  Budgets budgets;
  bool until_done = false;  // end when every job has ended or used up its budget
  bool json = false;        // print the report as JSON at the end
  // File with the costs so far. It is read at the start, so that the sums of an earlier run are continued,
  // and written after each check.
  std::filesystem::path report;
};

// Runs until a signal asks it to end or, with until_done, until every job has ended or used up its budget.
// It then drains its workers (they deliver their results and end) and returns the exit code.
int run_farm_up(FarmApi& api, Engine& engine, const FarmUpOptions& options, Interrupt& interrupt);

// Identifies the workers of this farm-up (all runs of `lightshaft farm up` under one name): their names
// begin with "FARM-", and they run on `engine`.
struct OurWorkers {
  std::string farm, engine;
};
// Adds the costs in the coordinator's answers to GET /api/v1/jobs and GET /api/v1/workers to `spending`.
// Returns how much work waits (the *demand*), without the work of jobs whose budget is used up.
Demand demand_of(const nlohmann::json& jobs, const nlohmann::json& workers, const OurWorkers& ours,
                 Spending& spending);

}  // namespace ls::cli
