// Follows a job of a farm until it ends.
#pragma once

#include <functional>
#include <string>

#include "cli/farm/farm_api.h"
#include "cli/output/progress.h"

namespace ls::cli {

struct WatchOptions {
  bool quiet = false;
  bool json = false;  // print the job as one JSON line on stdout after each change
};
// The finished job, or the error for which it cannot be followed. Waits for a coordinator that is unreachable
// for a while (a restart).
FarmApi::Answer<nlohmann::json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options);

ProgressFigures progress_of(const nlohmann::json& job);

// For a finished job prints the error of its image (with `quiet` only if it is not to be trusted) and returns
// kOk; otherwise prints why it is not done and returns kFailed.
int print_end(const nlohmann::json& job, bool quiet);

}  // namespace ls::cli
