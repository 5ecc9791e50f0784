// Makes the views of jobs, sequences and workers that clients see (views/job_view.h).
#pragma once

#include "coordinator/domain/farm/farm.h"
#include "coordinator/service/state/eta.h"
#include "coordinator/service/state/job_entry.h"
#include "coordinator/service/state/worker_entry.h"

namespace ls::coordinator {

class JobViews {
 public:
  JobViews(const Farm& farm, const Clock& clock) : farm_(farm), clock_(clock) {}

  JobView job(const JobEntry& entry) const;
  JobView sequence(const JobId& id, const Sequence& sequence, bool with_frames) const;
  WorkerView worker(const WorkerId& id, const WorkerEntry& worker) const;

 private:
  Eta eta(const JobEntry& entry, const JobFigures& figures, const JobView& v) const;

  const Farm& farm_;
  const Clock& clock_;
};

}  // namespace ls::coordinator
