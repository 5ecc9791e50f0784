// Writes the report of a job as JSON, and computes values for it from the job's image and its convergence
// curve (the errors at earlier points of the render).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/assemble/meter_values.h"
#include "coordinator/store/jobs/job_store.h"
#include "core/base/digest.h"
#include "core/image/error/convergence.h"
#include "core/image/error/error_estimate.h"
#include "core/image/film/film.h"
#include "core/image/reference/reference.h"
#include "util/denoise/denoised_image.h"

namespace ls::coordinator {

// Facts about the denoised image of a job.
struct DenoisedFigures {
  std::string by;       // name and version of the denoiser; empty: the image could not be denoised
  std::string trouble;  // why the image could not be denoised
  DenoisedError error;
  double seconds = 0;                   // duration of denoising
  std::optional<TrueError> true_error;  // error against the job's reference
};

struct ReportFacts {
  StoredJob job;  // the job as stored, but with its totals brought up to date
  std::uint64_t samples = 0;
  // Error of the current image, over the pixels that have a sample. nullopt: no pixel has one
  std::optional<ImageError> error;
  std::optional<AreaError> areas;  // of the same pixels
  std::uint64_t pixels_without_samples = 0;
  Digest pixels;
  std::uint64_t clamped_values = 0;  // number of values too large for the half floats of the final EXR
  std::vector<ConvergencePoint> convergence;
  std::string replay;                             // command that renders one sample again (replay_command())
  std::optional<ReferenceNoise> reference_noise;  // nullopt: unknown, or there is no reference
  std::optional<DenoisedFigures> denoised;        // nullopt: not requested, or not made yet
  std::vector<MeterValue> meters;                 // empty: the job makes an image
};
std::string report_json(const ReportFacts& facts);
// Sets the facts that come from the film: samples, pixels without samples, error, and areas.
void put_film(ReportFacts& facts, const Film& film);

// Judges from the curve and the current error whether the image's error estimates can be trusted.
ConvergenceStatus convergence_status_of(const ReportFacts& facts);
struct Efficiency {
  // wall: 1 / (relMSE x wall-clock seconds); per_core: 1 / (relMSE x core seconds)
  std::optional<double> wall, per_core;
};
Efficiency efficiency_of(const ReportFacts& facts);
// Returns further numbers for the header of the final EXR: slope, efficiency, efficiency_per_core,
// target_error, true_rmse, true_relmse, denoised_relmse, denoised_rmse. Those that are unknown are left out.
std::map<std::string, double> header_figures(const ReportFacts& facts);
// Returns texts for the header of the final EXR, each only if it applies: true_below_noise,
// reference_same_seed, fake, target_layer (for denoised layers), denoised_by, denoised_relmse_ci95 and
// denoised_rmse_ci95.
std::map<std::string, std::string> header_notes(const ReportFacts& facts);

// Returns a note, for the report and the EXR header, on the image of a job that stopped at its target error
// or its time limit. The text is empty for other jobs. `layer` is the layer to which the target error
// applies.
std::string note_on(StopReason stopped, TargetLayer layer);
TimeSplit split_of(const JobTotals& totals);
ErrorFigures figures_of(const ImageError& error);
// Converts the points of a job's curve. Without `with_reference_error` the result lacks the errors against
// the reference.
std::vector<ErrorPoint> error_points(const std::vector<ConvergencePoint>& points,
                                     bool with_reference_error = true);
// Returns the error against the reference at the last checkpoint that has one
std::optional<ReferenceError> last_reference_error(const std::vector<ConvergencePoint>& points);

}  // namespace ls::coordinator
