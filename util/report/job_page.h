// The report of a job as one self-contained HTML file: image, convergence curves, maps of error and samples,
// where the time was spent, numeric health, used and unused features, provenance. It depends only on its
// input. The farm serves it, and `lightshaft render --html` writes it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls::report {

struct JobPage {
  std::string report;                                    // JSON as returned by GET /api/v1/jobs/ID/report
  std::vector<std::byte> image, error_map, samples_map;  // PNG files; empty: not available
  bool denoised = false;                                 // true: `image` is the denoised picture
};
// Generates the page. A part of the page is left out if the report lacks a field that it needs, or the field
// has the wrong type. invalid_argument: the report is not a JSON object.
Result<std::string> job_page(const JobPage& page);
// Returns the content security policy of a page by job_page(), as a header for the HTTP response with the
// page. The page itself contains the same policy.
std::string job_page_policy();

}  // namespace ls::report
