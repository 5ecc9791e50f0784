// The sections of a job's page, as markup generated from the job's report. A section is empty if the report
// has no data for it.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ls::report {

// Functions that read fields of a report. The report may come from another version of this program or from
// another program. So each function returns the value of the field `key`, or a default if the field is
// missing or has the wrong type.
using Json = nlohmann::json;

const Json& member(const Json& j, const char* key);  // null if missing
double number(const Json& j, const char* key);       // NaN if missing
std::string text(const Json& j, const char* key);    // empty if missing
bool flag(const Json& j, const char* key, bool otherwise);
// Returns the two numbers of a field [lo, hi]; nullopt if missing.
std::optional<std::pair<double, double>> interval(const Json& j, const char* key);
std::vector<Json> objects(const Json& j, const char* key);       // the elements of a list that are objects
std::vector<std::string> texts(const Json& j, const char* key);  // the elements of a list that are strings

// Convergence status (job_facts.cpp).
bool doubtful(const Json& report);  // true if the error figures are not reliable yet
// Returns the reason why the error figures are not reliable, and further notes on the result.
std::string verdict(const Json& report);
// Returns a sentence on the convergence, for a report with reliable error figures; empty: there is none.
std::string verdict_words(const Json& report);
std::string failure(const Json& report);
bool denoised_target(const Json& report);  // true if the target error applies to the denoised layers

// Error against time (job_curves.cpp).
std::string curves(const Json& report);
std::string outlook(const Json& report);  // how much more core time a smaller error needs; empty: unknown

// The values of the scene's meters, key numbers of the job, and where its time was spent
// (job_figures.cpp).
std::string meters(const Json& report);
std::string figures(const Json& report);
std::string time_split(const Json& report);

// Facts about the job (job_facts.cpp).
std::string health(const Json& report);
std::string techniques(const Json& report);
std::string features(const Json& report);
std::string provenance(const Json& report);

std::string section(std::string_view title, std::string_view body, std::string_view css_class = {});
std::string_view page_css();

}  // namespace ls::report
