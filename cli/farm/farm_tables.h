// Formats a farm's answers for users.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ls::cli {

std::string jobs_table(const nlohmann::json& answer);     // formats the answer to GET /jobs
std::string tokens_table(const nlohmann::json& answer);   // formats the answer to GET /tokens
std::string workers_table(const nlohmann::json& answer);  // formats the answer to GET /workers
std::string job_text(const nlohmann::json& job);          // formats the answer to GET /jobs/ID
bool is_over(const nlohmann::json& job);                  // true if the job is done, failed or cancelled

}  // namespace ls::cli
