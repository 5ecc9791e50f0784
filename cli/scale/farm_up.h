// `lightshaft farm up`: runs as many workers as a farm's jobs need, until the user stops it. An *engine*
// (Slurm, ssh, Docker or Kubernetes) starts and ends them.
#pragma once

#include <filesystem>

#include "cli/farm/farm_api.h"
#include "cli/output/interrupt.h"
#include "cli/scale/engine.h"
#include "cli/scale/scaler.h"
#include "cli/scale/spending.h"

namespace ls::cli {

struct FarmUpOptions {
  ScaleLimits limits;
  Budgets budgets;
  bool until_done = false;       // end when no job is queued or running
  bool json = false;             // print the report as JSON at the end
  std::filesystem::path report;  // file with the costs so far; read at the start, to continue their sums, and
                                 // written after each check
};

// Returns the exit code. Before it returns, because of a signal or of until_done, it drains its workers: they
// deliver their results and end.
int run_farm_up(FarmApi& api, Engine& engine, const FarmUpOptions& options, Interrupt& interrupt,
                const Clock& clock);

}  // namespace ls::cli
