// Formats a farm's answers for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ls::cli {

std::string jobs_table(const nlohmann::json& answer);     // of GET /jobs
std::string tokens_table(const nlohmann::json& answer);   // of GET /tokens
std::string workers_table(const nlohmann::json& answer);  // of GET /workers
std::string job_text(const nlohmann::json& job);          // of GET /jobs/ID

}  // namespace ls::cli
