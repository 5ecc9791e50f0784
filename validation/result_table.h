// Formats the table of `lightshaft validate`, case by case.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "validation/measure/judge.h"

namespace ls::cli {

std::string table_heading();
std::string table_line(const ValidateCase& c);
// Returns {"cases": [{name, expected, got, stderr, allowance, z, p, level, verdict, nonfinite, seconds,
// why}], "passed", "failed"}.
nlohmann::ordered_json table_json(const std::vector<ValidateCase>& cases);

}  // namespace ls::cli
