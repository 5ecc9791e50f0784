// The report of a job as one self-contained HTML file: image, curves, maps, time split, health, omitted
// features, provenance. Pure: the farm serves it, `lightshaft render --html` writes it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls::report {

struct JobPage {
  std::string report;                                    // the JSON of GET /api/v1/jobs/ID/report
  std::vector<std::byte> image, error_map, samples_map;  // PNG files; empty: none
};
// Makes the page. Parts for which a field of the report is missing or of the wrong type are omitted.
// invalid_argument: the report is not a JSON object.
Result<std::string> job_page(const JobPage& page);
// Returns the content security policy for the HTTP response that carries such a page; the page itself has the
// same.
std::string job_page_policy();

}  // namespace ls::report
