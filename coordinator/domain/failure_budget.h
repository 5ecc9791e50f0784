// Counts failed attempts to render a unit (one round of one tile). Decides when a unit has failed often
// enough to fail its job, and when a worker gets no more units of a job. Only failures to render count, not
// those of the infrastructure: a lost worker, a missed deadline, or a lease (the list of units assigned to a
// worker) that the worker gave back.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "coordinator/domain/limits.h"
#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

struct FailedAttempt {
  WorkerIndex worker = kNoWorker;
  std::string worker_name;
  UnitFailure failure;
};

// The units of one job that have failed and have no accepted result yet
class UnitFailures {
 public:
  void add(UnitCode code, FailedAttempt attempt);
  void accepted(UnitCode code) { units_.erase(code); }
  // True if this worker has failed on this unit.
  bool failed_on(UnitCode code, WorkerIndex worker) const;
  // True if the unit has failed on min(kUnitFailureWorkers, workers_known) distinct workers and in at least
  // kUnitFailureAttempts attempts. `workers_known`: number of connected workers that could render the job.
  bool exhausted(UnitCode code, std::size_t workers_known) const;
  const std::vector<FailedAttempt>& attempts(UnitCode code) const;
  void mark_workers(std::vector<bool>& used) const {
    for (const auto& [code, attempts] : units_)
      for (const FailedAttempt& attempt : attempts) used[attempt.worker] = true;
  }

 private:
  // The latest attempts of each unit; add() limits their number
  std::map<UnitCode, std::vector<FailedAttempt>> units_;
};

// Failures of one worker in one job
struct WorkerFailures {
  std::uint32_t count = 0;
  TimePoint last{};
  bool blocked = false;

  void add(TimePoint now) {
    if (count > 0 && forgiven_at(now)) *this = {};
    ++count;
    last = now;
    blocked = count >= kWorkerFailuresPerJob;
  }
  bool forgiven_at(TimePoint now) const { return now - last >= kForgiveAfter; }
  bool blocked_at(TimePoint now) const { return blocked && !forgiven_at(now); }
};

// Returns the error message of a failed job for its owner: unit, pixel, signal, what each worker reported,
// how to replay it.
std::string describe_failure(const PixelRect& rect, const SampleRange& samples,
                             const std::vector<FailedAttempt>& attempts, const std::string& replay);

}  // namespace ls::coordinator
