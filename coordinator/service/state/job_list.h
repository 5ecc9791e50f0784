// Selects and orders the jobs that a client's list shows (views/job_list.h).
#pragma once

#include "coordinator/service/state/job_table.h"
#include "coordinator/service/state/job_views.h"
#include "coordinator/views/job_list.h"

namespace ls::coordinator {

// Makes views only of the jobs on the page, unless the order needs the views of all.
JobsPage list_jobs(JobTable& jobs, const JobViews& views, const JobsAsked& asked);

}  // namespace ls::coordinator
