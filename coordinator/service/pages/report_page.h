// The report of a job as a page (util/report/job_page.h), with the job's pictures.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/base/id.h"

namespace ls::coordinator {

class Coordinator;

// `report` is the job's report as JSON. The picture is the denoised image if the job has ended and has one,
// else the image itself; its caption says which.
Result<std::string> report_page(const Coordinator& coordinator, const JobId& job, std::string report);

}  // namespace ls::coordinator
