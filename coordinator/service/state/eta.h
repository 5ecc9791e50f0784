// Predicts when a job will be done, from measurements so far. It has no state and no clock. A unit is one
// round (range of samples) of one tile; a worker renders it on one thread.
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "common/image/error/convergence.h"

namespace ls::coordinator {

struct EtaInputs {
  double done = 0;          // fraction of the requested samples, 0 to 1
  double core_seconds = 0;  // core seconds spent so far, counted as in the convergence points
  // Predicted core seconds until the job ends. For an adaptive job (one with a target error) this is the
  // scheduler's own prediction; 0: unknown
  double core_left = 0;
  double core_to_limit = 0;  // the same until the sample limit; 0: unknown
  // The target error (relMSE) and the time budget (seconds since the first ray); nullopt: the job has none
  std::optional<double> target, time;
  double elapsed = 0;  // seconds since the first ray
  // CPU seconds per wall-clock second that the job's workers give it, or would give it if it were running
  double cores = 0;
  // `cores` if kMoreWorkers more workers joined; no more than `cores` if they would not help
  double cores_with_more = 0;
  double unit_seconds = 0;   // mean core seconds of a remaining unit; 0: unknown
  double units_at_once = 0;  // units that can be rendered at the same time; 0: no limit
};

struct Eta {
  double progress = 0;
  std::optional<double> seconds;                  // seconds from now until the job is done; nullopt: unknown
  std::optional<std::pair<double, double>> ci95;  // 95 % interval of `seconds`, if the target ends the job
  std::optional<double> with_more;                // `seconds` with more workers, if that is less
  std::optional<std::pair<double, double>> with_more_ci95;
};

// Predicts the end by samples, target error or time, whichever comes first. The core seconds until the target
// are forecast from `points` (convergence.h), minus those spent since the last point. Before the first
// checkpoint of an adaptive job, the scheduler's own prediction is used, without an interval. A unit runs on
// one thread: few units keep few threads busy, and at the end of a job with a target threads wait for the
// last units. An interval is cut at the sample limit.
Eta eta_of(const EtaInputs& facts, std::span<const ErrorPoint> points);

}  // namespace ls::coordinator
