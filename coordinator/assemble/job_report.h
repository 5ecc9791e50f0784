// The report of a job, as JSON.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/image/error/convergence.h"
#include "common/image/error/error_estimate.h"
#include "common/image/film/film.h"
#include "common/image/reference/reference.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

struct ReportFacts {
  StoredJob job;  // with current totals
  std::uint64_t samples = 0;
  // Error of the current image, over the pixels that have a sample; nullopt: none has
  std::optional<ImageError> error;
  std::uint64_t pixels_without_samples = 0;
  Digest pixels;
  std::uint64_t clamped_values = 0;  // in the final EXR
  std::vector<ConvergencePoint> convergence;
  std::string replay;                             // the job's replay_command()
  std::optional<ReferenceNoise> reference_noise;  // nullopt: unknown, or there is no reference
};
std::string report_json(const ReportFacts& facts);
// Sets samples, pixels without samples and error from the film.
void put_film(ReportFacts& facts, const Film& film);

// Judges how far the image's error estimates can be trusted.
ConvergenceStatus convergence_status_of(const ReportFacts& facts);
struct Efficiency {
  std::optional<double> wall, per_core;  // 1 / (relMSE x wall-clock seconds), 1 / (relMSE x core seconds)
};
Efficiency efficiency_of(const ReportFacts& facts);
// Numbers for the final EXR's header besides those of the film: slope, efficiency, efficiency_per_core,
// target_error, true_rmse, true_relmse, as far as known.
std::map<std::string, double> header_figures(const ReportFacts& facts);
// true_below_noise, reference_same_seed and fake, if they apply
std::map<std::string, std::string> header_notes(const ReportFacts& facts);

// A note on an image that ended for another reason than its samples; else empty.
std::string note_on(StopReason stopped);
TimeSplit split_of(const JobTotals& totals);
ErrorFigures figures_of(const ImageError& error);
// Without `with_reference_error` the points lack the errors against the reference.
std::vector<ErrorPoint> error_points(const std::vector<ConvergencePoint>& points,
                                     bool with_reference_error = true);
// The error of the last checkpoint that has one
std::optional<ReferenceError> last_reference_error(const std::vector<ConvergencePoint>& points);

}  // namespace ls::coordinator
