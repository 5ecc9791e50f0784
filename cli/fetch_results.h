// What came of a job, from a farm to files here.
#pragma once

#include <optional>
#include <string>

#include "cli/farm_api.h"

namespace ls::cli {

struct Results {
  std::string image, report, html;  // names of files; empty: not wanted. A run of # is the number of a frame
  bool json = false;                // each file as a line of JSON on stdout
  bool patient = false;             // a coordinator that is away for a while is waited for
};

// Before a job is submitted: can files of such a name, or of each frame's, be written?
Result<void> check_outputs(const std::string& option, const std::string& name,
                           const std::optional<FrameRange>& frames);

// Of a sequence every frame that there is something of, and the others are told; its report as a whole if the
// name has no #. Returns the exit code.
int fetch_results(FarmApi& api, const std::string& id, const Results& results);

}  // namespace ls::cli
