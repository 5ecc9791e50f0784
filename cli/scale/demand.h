// Reads from a coordinator's HTTP API how much work waits, for Scaler, and what has been spent.
#pragma once

#include "cli/farm/farm_api.h"
#include "cli/scale/scaler.h"
#include "cli/scale/spending.h"

namespace ls::cli {

// Tells our workers from others: those named FARM-... are ours, and run on `engine`.
struct OurWorkers {
  std::string farm, engine;
};

// Jobs whose budget is used up are left out of the demand.
FarmApi::Answer<Demand> ask_demand(FarmApi& api, const OurWorkers& ours, Spending& spending);

// The same from the answers to GET /api/v1/jobs and GET /api/v1/workers.
Demand demand_of(const nlohmann::json& jobs, const nlohmann::json& workers, const OurWorkers& ours,
                 Spending& spending);

}  // namespace ls::cli
