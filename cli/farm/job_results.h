// Follows a job of a farm until it ends, and downloads its results to local files.
#pragma once

#include <functional>
#include <string>

#include "cli/farm/farm_api.h"
#include "cli/output/progress.h"

namespace ls::cli {

struct WatchOptions {
  bool quiet = false;
  bool json = false;  // print the job as a line of JSON on stdout after each change
  // Called with the job each time that it was asked for; empty: nothing is called
  std::function<void(const nlohmann::json& job)> each = {};
};
// Waits until the job `id` ends and returns the job. If the coordinator cannot be reached, as during a
// restart, keeps trying for a while (RetryPolicy), and then returns the error.
FarmApi::Answer<nlohmann::json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options);

// Says that the job goes on after Ctrl-C, and how to come back to it.
std::string goes_on(const std::string& id);
// Returns a name for the image of a job, in the working folder: that of its scene, as `render` names it.
std::string default_image(const nlohmann::json& job);

ProgressFigures progress_of(const nlohmann::json& job);

// Returns how many frames of a sequence (a job with several frames) are done; 0 for other jobs.
int done_frames(const nlohmann::json& job);

// Prints how a job ended. If it is done, prints the error of its image (with `quiet` only if the error cannot
// be trusted) and returns kOk; otherwise prints the reason, and how to fetch the frames that are done, and
// returns kFailed.
int print_end(const nlohmann::json& job, bool quiet);
// Prints the error of the denoised image of a job that is done, or why there is none, of the job's report,
// which this function downloads. Prints nothing if no denoising was requested, or if `job` has that error.
void print_denoised(FarmApi& api, const nlohmann::json& job);
// Prints what the meters of the job have measured, which this function downloads. Prints nothing if the job
// makes an image or is a sequence.
void print_meters(FarmApi& api, const nlohmann::json& job);

struct Results {
  // Names of the files to write; empty: this result is not wanted. A run of # in the last component is
  // replaced by the frame number.
  std::string image, report, html;
  std::string mix;       // JSON of the mix of light groups to fetch instead of the image; empty: none
  std::string view;      // the view of a PNG; empty: sRGB
  bool json = false;     // print each file as a line of JSON on stdout
  bool patient = false;  // keep trying for a while if the coordinator is unreachable
  // Of a sequence, only the frames that are done; without it, all that have data.
  bool done_only = false;
};

// Downloads the results of job `id`; returns the exit code. For a sequence (a job with several frames),
// downloads every frame that has data or is done; if there are others, prints their numbers and how to fetch
// them later, and returns kFailed. A report name without # gets one report for the whole sequence.
int fetch_results(FarmApi& api, const std::string& id, const Results& results);

}  // namespace ls::cli
