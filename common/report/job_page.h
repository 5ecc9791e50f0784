// The report of a job as one self-contained HTML file: image, curves, maps, time split, health, unused
// features, provenance. It depends only on its input. The farm serves it, and `lightshaft render --html`
// writes it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls::report {

struct JobPage {
  std::string report;                                    // JSON as returned by GET /api/v1/jobs/ID/report
  std::vector<std::byte> image, error_map, samples_map;  // PNG files; empty: not available
};
// Makes the page. A part is left out if a field that it needs is missing or has the wrong type.
// invalid_argument: the report is not a JSON object.
Result<std::string> job_page(const JobPage& page);
// Returns the content security policy for the HTTP response that contains such a page; the page itself has
// the same policy.
std::string job_page_policy();

}  // namespace ls::report
