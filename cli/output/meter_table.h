// Formats what the meters of a job have measured, for users.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ls::cli {

// `meters` is a list of meters as in a job's report. The table has the first of them, and says how many there
// are more. Empty if there are none.
std::string meter_table(const nlohmann::json& meters);

}  // namespace ls::cli
