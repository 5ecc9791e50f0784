// Predicts when a job will be done, from what has been measured so far. No state, no clock.
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "common/image/error/convergence.h"

namespace ls::coordinator {

struct EtaInputs {
  double done = 0;          // fraction of the requested samples, 0 to 1
  double core_seconds = 0;  // spent so far, as counted in the convergence points
  // Until the job ends by its samples or, in an adaptive job, by the scheduler's own prediction of the
  // target; 0: unknown
  double core_left = 0;
  double core_to_limit = 0;            // until the sample limit, regardless of the error; 0: unknown
  std::optional<double> target, time;  // relMSE; seconds since the first ray
  double elapsed = 0;                  // seconds since the first ray
  double cores = 0;  // of the threads that work on it, or would: CPU seconds per second of wall-clock time
  double cores_with_more = 0;  // with more workers; at most `cores` if they would not help
  double unit_seconds = 0;     // mean core seconds of a remaining unit; 0: unknown
  double units_at_once = 0;    // most units that can be rendered at once, each on one thread; 0: no limit
};

struct Eta {
  double progress = 0;
  std::optional<double> seconds;                  // from now; nullopt: unknown
  std::optional<std::pair<double, double>> ci95;  // if the target ends the job
  std::optional<double> with_more;                // `seconds` with more workers, if that is less
  std::optional<std::pair<double, double>> with_more_ci95;
};

// The job ends by samples, target or time, whichever comes first. The forecast of the target counts from the
// last point (convergence.h), minus what has been spent since. Until the first checkpoint, adaptive jobs use
// the scheduler's own prediction, without an interval. A unit runs on one thread, so few units use few
// threads, and at the end of a job with a target threads wait for the last units. A forecast's interval is
// cut at the sample limit.
Eta eta_of(const EtaInputs& facts, std::span<const ErrorPoint> points);

}  // namespace ls::coordinator
