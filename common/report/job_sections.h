// The sections of a job's page, as markup generated from the job's report. A section is empty if the report
// has no data for it.
#pragma once

#include <string>
#include <string_view>

#include "common/report/report_json.h"

namespace ls::report {

// Convergence status (job_verdict.cpp).
bool doubtful(const Json& report);              // true if the error figures are not reliable yet
std::string verdict(const Json& report);        // why they are not reliable, with further notes
std::string verdict_words(const Json& report);  // a sentence for a report that is not doubtful; empty: none
std::string failure(const Json& report);

// Error against time (job_curves.cpp).
std::string curves(const Json& report);
std::string outlook(const Json& report);  // a sentence on the cost of less error; empty: unknown

// Figures (job_figures.cpp).
std::string figures(const Json& report);
std::string time_split(const Json& report);

// Facts about the job (job_facts.cpp).
std::string health(const Json& report);
std::string features(const Json& report);
std::string provenance(const Json& report);

std::string section(std::string_view title, std::string_view body, std::string_view css_class = {});
std::string_view page_css();

}  // namespace ls::report
