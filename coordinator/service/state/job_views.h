// Makes the views of jobs, sequences and workers that clients see (views/views.h).
#pragma once

#include "coordinator/domain/farm/farm.h"
#include "coordinator/service/state/eta.h"
#include "coordinator/service/state/job_entry.h"
#include "coordinator/service/state/job_table.h"
#include "coordinator/service/state/worker_entry.h"
#include "coordinator/views/views.h"

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

// Selects and orders the jobs that a client's list shows. Makes views only of the jobs on the page, unless
// the order needs the views of all.
JobsPage list_jobs(JobTable& jobs, const JobViews& views, const JobsAsked& asked);

}  // namespace ls::coordinator
