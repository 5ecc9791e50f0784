// Asks a coordinator, through its HTTP API, how much work waits (the *demand*, for Scaler), and what each job
// and worker has cost (for Spending).
#pragma once

#include "cli/farm/farm_api.h"
#include "cli/scale/scaler.h"
#include "cli/scale/spending.h"

namespace ls::cli {

// Identifies the workers of this farm-up (all runs of `lightshaft farm up` under one name): their names
// begin with "FARM-", and they run on `engine`.
struct OurWorkers {
  std::string farm, engine;
};

// Asks the coordinator, adds the costs to `spending`, and returns the demand, without the work of jobs whose
// budget is used up.
FarmApi::Answer<Demand> ask_demand(FarmApi& api, const OurWorkers& ours, Spending& spending);

// Does the same as ask_demand(), with the coordinator's answers to GET /api/v1/jobs and GET /api/v1/workers.
Demand demand_of(const nlohmann::json& jobs, const nlohmann::json& workers, const OurWorkers& ours,
                 Spending& spending);

}  // namespace ls::cli
