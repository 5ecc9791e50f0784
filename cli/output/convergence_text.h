// Words for a terminal about a job's error and whether it can be trusted.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ls::cli {

struct Verdict {
  // few pixels carry the error, it has reached a bias floor, or no light has been found yet
  bool doubtful = false;
  std::string words;  // plain text; begins with kDoubt if doubtful
};
inline constexpr const char* kDoubt = "don't trust yet";

Verdict verdict_of(const nlohmann::json& job);            // of GET /jobs/ID
Verdict verdict_of_report(const nlohmann::json& report);  // of GET /jobs/ID/report

// "0.0123 (0.0118 to 0.0129)", "0.0123 (don't trust yet)", "-".
std::string estimate_text(const nlohmann::json& job, const char* key, const char* interval);
// "4:12 (3:06 to 5:30)", "at least 4:12" (for a doubtful job with a target), "-".
std::string time_left_text(const nlohmann::json& job, const nlohmann::json& times, const char* key,
                           const char* interval = nullptr);
// "0.0123", "below the reference's noise", "0.0123 (not to be trusted: ...)"; empty: unknown. `below`: the
// name of the flag for values below the noise.
std::string reference_error_text(const nlohmann::json& object, const char* key, const char* below,
                                 bool same_seed, int digits = 3);
// One line on the error of a job's image; empty: unknown.
std::string error_text(const nlohmann::json& job);

}  // namespace ls::cli
