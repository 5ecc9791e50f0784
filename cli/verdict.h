// Whether a job's figures of its own error are to be relied on, and what a terminal says of them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ls::cli {

struct Verdict {
  bool doubtful = false;  // few pixels carry the error, it stands on a floor, or no light was found yet
  std::string words;      // plain text; those of a doubtful one begin with kDoubt
};
inline constexpr const char* kDoubt = "don't trust yet";

Verdict verdict_of(const nlohmann::json& job);            // of GET /jobs/ID
Verdict verdict_of_report(const nlohmann::json& report);  // of GET /jobs/ID/report

// "0.0123 (0.0118 to 0.0129)", "0.0123 (don't trust yet)", "-".
std::string estimate_text(const nlohmann::json& job, const char* key, const char* interval);
// "4:12 (3:06 to 5:30)", "at least 4:12" (of a job in doubt with a target), "-".
std::string time_left_text(const nlohmann::json& job, const char* key, const char* interval = nullptr);
// "0.0123", "below the reference's noise", "0.0123 (not to be trusted: ...)"; empty: not known.
// `below`: the flag that says so.
std::string truth_text(const nlohmann::json& object, const char* key, const char* below, bool same_seed,
                       int digits = 3);
// What a job's image is worth, one line; empty: nothing is known of it.
std::string error_text(const nlohmann::json& job);

}  // namespace ls::cli
