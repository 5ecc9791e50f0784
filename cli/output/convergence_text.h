// Texts for a terminal about a job's error, whether it can be trusted, and its numeric health.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "util/report/phrases.h"

namespace ls::cli {

struct Verdict {
  // True if few pixels contribute most of the error, if the error has reached a bias floor (it no longer
  // falls), or if no light has been found yet.
  bool doubtful = false;
  std::string words;   // plain text; begins with kDoubt if doubtful
  std::string advice;  // what to do about the doubt; empty: nothing is known
};
inline constexpr const char* kDoubt = report::phrase("doubt");

Verdict verdict_of(const nlohmann::json& job);            // from the answer to GET /jobs/ID
Verdict verdict_of_report(const nlohmann::json& report);  // from the answer to GET /jobs/ID/report

// Returns the error that `job` has under `key`, as "0.0123 (0.0118 to 0.0129)", "0.0123 (don't trust yet)",
// or "-" if it is unknown. `interval` is the key of its 95 % interval in `job`.
std::string estimate_text(const nlohmann::json& job, const char* key, const char* interval);
// Returns the remaining time that `times` has under `key`, as "4:12 (3:06 to 5:30)", "at least 4:12" (for a
// doubtful job with a target), or "-" if it is unknown. `times` is `job` itself or an object in it.
// `interval` is the key of the interval in `times`.
std::string time_left_text(const nlohmann::json& job, const nlohmann::json& times, const char* key,
                           const char* interval = nullptr);
// Returns the error that `object` has under `key`, measured against the reference image: "0.0123"; or "below
// the reference's noise", if the flag under the key `below` is set; or "0.0123 (not to be trusted: ...)" if
// `same_seed`, since an image and a reference of the same seed share their noise. Empty: unknown. `digits`
// is the number of significant digits.
std::string reference_error_text(const nlohmann::json& object, const char* key, const char* below,
                                 bool same_seed, int digits = 3);
// Returns one line on the error of a job's image; empty: unknown.
std::string error_text(const nlohmann::json& job);
// Returns the error of the denoised image of a report (GET /jobs/ID/report) or a job: "0.0123 (0.0118 to
// 0.0129)", or why there is no such image; empty: no denoising was requested, or the image is not made yet.
std::string denoised_text(const nlohmann::json& of);

// Returns lines for the user about the numeric health of `job` (invalid samples and the like). `job` is a
// report or a farm's answer about a job. Each cause has its first location and the command that renders that
// sample again. Empty: the job is healthy, or its health is unknown.
std::vector<std::string> health_lines(const nlohmann::json& job);
bool unclean(const nlohmann::json& job);

// Prints the health_lines() to stderr, under a heading.
void print_health(const nlohmann::json& job);

}  // namespace ls::cli
