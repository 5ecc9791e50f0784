// The report of a job, as JSON: DESIGN's contract, plus what helps a person.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/image/convergence.h"
#include "common/image/error_estimate.h"
#include "common/image/film.h"
#include "common/image/reference.h"
#include "coordinator/store/job_store.h"

namespace ls::coordinator {

struct ReportFacts {
  StoredJob job;  // with totals as of now
  std::uint64_t samples = 0;
  std::optional<ImageError>
      error;  // of the image as it is, of those pixels that have a sample; nothing: none has
  std::uint64_t pixels_without_samples = 0;
  Digest pixels;
  std::uint64_t clamped_values = 0;  // in the final EXR
  std::vector<ConvergencePoint> convergence;
  std::string replay;                             // the job's replay_command()
  std::optional<ReferenceNoise> reference_noise;  // nothing: it is not known, or there is no reference
};
std::string report_json(const ReportFacts& facts);
// Samples, pixels without, error: as the film is.
void put_film(ReportFacts& facts, const Film& film);

// What is to be thought of the image's figures.
Judgement judgement_of(const ReportFacts& facts);
struct Efficiency {
  std::optional<double> wall, per_core;  // 1 / (relMSE x seconds), and x core seconds
};
Efficiency efficiency_of(const ReportFacts& facts);
// Of the final EXR's header besides those of the film: slope, efficiency, efficiency_per_core, target_error,
// true_rmse, true_relmse, as far as they are known.
std::map<std::string, double> header_figures(const ReportFacts& facts);
// true_below_noise, reference_same_seed and fake, where they are so.
std::map<std::string, std::string> header_notes(const ReportFacts& facts);

// What to know of an image that was not ended by its samples; else empty.
std::string note_on(StopReason stopped);
TimeSplit split_of(const JobTotals& totals);
ErrorFigures figures_of(const ImageError& error);
// Without `with_truth` nothing is concluded from the true figures.
std::vector<ErrorPoint> error_points(const std::vector<ConvergencePoint>& points, bool with_truth = true);
// Of the last checkpoint that has them.
std::optional<TrueFigures> last_truth(const std::vector<ConvergencePoint>& points);

}  // namespace ls::coordinator
