// Saves the report of a local render as an HTML page (common/report/job_page.h).
#pragma once

#include <filesystem>
#include <string>

#include "coordinator/service/coordinator.h"

namespace ls::cli {

// Writes the page to `file`. `report` is the JSON report of this job.
Result<void> save_html_report(const std::filesystem::path& file, const coordinator::Coordinator& coordinator,
                              const JobId& job, const std::string& report);

}  // namespace ls::cli
