// Following a job of a farm until it ends.
#pragma once

#include <functional>
#include <string>

#include "cli/farm_api.h"
#include "cli/progress.h"

namespace ls::cli {

struct WatchOptions {
  bool quiet = false;
  bool json = false;  // the job as one JSON line on stdout whenever it has changed
};
// The job as it ended, or why it can't be followed. A coordinator that is away for a while (a restart) is
// waited for.
FarmApi::Answer<nlohmann::json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options);

ProgressFigures progress_of(const nlohmann::json& job);

// Says what the image of a job that is done is worth, of one that is to be trusted not if `quiet`, and
// returns kOk; otherwise says why it is not done and returns kFailed.
int say_end(const nlohmann::json& job, bool quiet);

}  // namespace ls::cli
