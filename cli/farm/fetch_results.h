// Downloads a job's results from a farm to local files.
#pragma once

#include <optional>
#include <string>

#include "cli/farm/farm_api.h"

namespace ls::cli {

struct Results {
  // File names; empty: not wanted. A run of # is replaced by the frame number
  std::string image, report, html;
  bool json = false;     // print each file as a line of JSON on stdout
  bool patient = false;  // keep trying for a while if the coordinator is unreachable
};

// Checks, before a job is submitted, that files of this name (or one per frame) can be written.
Result<void> check_outputs(const std::string& option, const std::string& name,
                           const std::optional<FrameRange>& frames);

// Downloads the results of job `id`; returns the exit code. For a sequence (a job with several frames),
// downloads every frame that has data; if any has none, prints the numbers of those frames and returns
// kFailed. A report name without # gets one report for the whole sequence.
int fetch_results(FarmApi& api, const std::string& id, const Results& results);

}  // namespace ls::cli
