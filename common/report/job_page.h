// The report of a job as one HTML file that needs nothing but itself: image, curves, maps, where the time
// went, health, what was left out, provenance. Pure: the farm serves it, `lightshaft render --html` writes
// it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls::report {

struct JobPage {
  std::string report;                                    // the JSON of GET /api/v1/jobs/ID/report
  std::vector<std::byte> image, error_map, samples_map;  // PNG files; empty: there is none
};
// What the report lacks is left out of the page; what it has of another type than it should counts as
// lacking. invalid_argument: it is no JSON object.
Result<std::string> job_page(const JobPage& page);
// Of the response that carries such a page: what its own policy says, and no more.
std::string job_page_policy();

}  // namespace ls::report
