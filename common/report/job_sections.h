// The parts of the page of a job: markup out of its report. Each is empty if the report has nothing of it.
#pragma once

#include <string>
#include <string_view>

#include "common/report/report_json.h"

namespace ls::report {

// ---- what to think of it (job_verdict.cpp) ----
bool doubtful(const Json& report);              // its error figures are not to be relied on yet
std::string verdict(const Json& report);        // why they are not, and what else is to be known of them
std::string verdict_words(const Json& report);  // of one that is not doubtful, a sentence; empty: none
std::string failure(const Json& report);

// ---- error against time (job_curves.cpp) ----
std::string curves(const Json& report);
std::string outlook(const Json& report);  // what less error would cost, a sentence; empty: not known

// ---- figures (job_figures.cpp) ----
std::string figures(const Json& report);
std::string time_split(const Json& report);

// ---- what it is made of (job_facts.cpp) ----
std::string health(const Json& report);
std::string features(const Json& report);
std::string provenance(const Json& report);

std::string section(std::string_view title, std::string_view body, std::string_view css_class = {});
std::string_view page_css();

}  // namespace ls::report
