// The report of a local render as a page (common/report/job_page.h).
#pragma once

#include <filesystem>
#include <string>

#include "coordinator/service.h"

namespace ls::cli {

// `report`: the JSON that is told of this job elsewhere, too.
Result<void> save_html_report(const std::filesystem::path& file, const coordinator::Coordinator& coordinator,
                              const JobId& job, const std::string& report);

}  // namespace ls::cli
