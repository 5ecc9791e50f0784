// Makes the views of jobs, sequences (jobs with frames) and workers that clients see (views/views.h), with
// predictions of when jobs will be done. Terms: docs/reference/glossary.md. Terms:
// docs/reference/glossary.md.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/domain/farm/farm.h"
#include "coordinator/service/state/job_table.h"
#include "coordinator/service/state/worker_entry.h"
#include "coordinator/views/views.h"
#include "core/image/error/convergence.h"

namespace ls::coordinator {

// The inputs from which the end of a job is predicted
struct EtaInputs {
  double done = 0;          // fraction of the requested samples, 0 to 1
  double core_seconds = 0;  // core seconds spent on rendering so far, as in ErrorPoint::core_seconds
  // Core seconds until the job ends, as the scheduler predicts them; 0: unknown. eta_of() prefers the
  // forecast from the convergence points for a job with a target error.
  double core_left = 0;
  double core_to_limit = 0;  // predicted core seconds until all requested samples are rendered; 0: unknown
  // The target error (relMSE) and the time budget (seconds since the first ray); nullopt: the job has none
  std::optional<double> target, time;
  double elapsed = 0;  // seconds since the first ray
  // Number of cores that render the job or, if none do, that would render it
  double cores = 0;
  // Number of cores that the job would have if kMoreWorkers more workers joined; at most `cores` if the job
  // could not use more workers
  double cores_with_more = 0;
  double unit_seconds = 0;   // mean core seconds of a remaining unit; 0: unknown
  double units_at_once = 0;  // number of units that can be rendered at the same time; 0: no limit
};

struct Eta {
  double progress = 0;
  std::optional<double> seconds;  // time until the job is done; nullopt: unknown
  // 95 % interval of `seconds`; nullopt unless the target error is predicted to end the job
  std::optional<std::pair<double, double>> ci95;
  // Seconds until the job is done if kMoreWorkers more workers joined; nullopt: not less than `seconds`
  std::optional<double> with_more;
  std::optional<std::pair<double, double>> with_more_ci95;  // 95 % interval of `with_more`
};

// Predicts when the job ends: when it has its samples, reaches its target error or has used up its time,
// whichever comes first. The core seconds until the target are forecast from `points` (convergence.h), and
// those spent since the last point are subtracted. Without a forecast, for example before the first
// checkpoint, the scheduler's prediction is used, and there is no interval. The prediction also considers
// that a unit runs on one thread: the job cannot use more threads than it has units, and at the end of a job
// with a target error the threads wait for the last units. The ends of an interval include at most the work
// until all requested samples are rendered.
Eta eta_of(const EtaInputs& facts, std::span<const ErrorPoint> points);

// Returns the state of the sequence. While frames are open (have not ended), it is paused if all of them are
// paused, else queued if no frame has begun, else running. Then it is failed if any frame failed, else
// cancelled if any was cancelled, else done.
JobState sequence_state(std::span<const JobView> frames);

struct SequenceFacts {
  JobId id;
  FrameRange range;
  std::vector<std::string> warnings;  // warnings of all frames, each text once
  double elapsed_seconds = 0;
  double cores = 0;  // number of cores of the connected workers
  int workers = 0;   // number of connected workers
  // Wall-clock seconds from the end of one frame to that of the next, mean over the frames that ended last;
  // 0: fewer than two frames have ended
  double frame_seconds = 0;
};
// Makes the view of a sequence from the views of its frames (at least one, in ascending order). The
// sequence's error is the mean over the pixels of all frames that have an error estimate; its interval treats
// these estimates as independent. The cost of the remaining frames is extrapolated from the work so far: CPU
// seconds, and the time in which a worker loads a frame. The remaining time assumes as many cores and workers
// as the sequence's limits allow and its units can keep busy. It is not less than the remaining frames take
// at the rate of the last ones.
JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames);

FrameView frame_view(const JobView& frame);

class JobViews {
 public:
  JobViews(const Farm& farm, const JobTable& jobs, const Clock& clock)
      : farm_(farm), jobs_(jobs), clock_(clock) {}

  JobView job(const JobEntry& entry) const;
  JobView sequence(const JobId& id, const Sequence& sequence, bool with_frames) const;
  WorkerView worker(const WorkerId& id, const WorkerEntry& worker) const;

 private:
  Eta eta(const JobEntry& entry, const JobFigures& figures, const JobView& v) const;

  const Farm& farm_;
  const JobTable& jobs_;
  const Clock& clock_;
};

}  // namespace ls::coordinator
