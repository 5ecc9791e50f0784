// `lightshaft farm up`: runs as many workers on an engine as a farm's jobs need, until the user stops it.
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
  bool until_done = false;       // ends when no job is queued or running
  bool json = false;             // prints the report as JSON at the end
  std::filesystem::path report;  // what was spent; read at the start, so that the sum goes on
};

// Returns the exit code. At the first signal, and when until_done ends it, its workers are drained first.
int run_farm_up(FarmApi& api, Engine& engine, const FarmUpOptions& options, Interrupt& interrupt,
                const Clock& clock);

}  // namespace ls::cli
