// The table that `lightshaft validate` fills, one case after the other, and how it is shown.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ls::cli {

struct ValidateCase {
  std::string name;
  double expected = 0, got = 0, standard_error = 0;
  double z = 0;  // (got - expected) in standard errors; of chi-square tests 0
  // How probable a figure at least as far off is if the program is right; and below which it is not believed.
  double p = 1, level = 0;
  std::uint64_t nonfinite = 0;  // samples that went wrong: with any the case fails
  double seconds = 0;
  std::string why;  // of a failure
  bool passed() const { return why.empty(); }
};

// What a case says once its figures are known: fills z, p and why. `freedom`: of the standard error. Up to
// `rounding` off is what float32 may do to a figure whose every sample is the same.
void judge(ValidateCase& c, double freedom, double rounding);

std::string table_heading();
std::string table_line(const ValidateCase& c);
// {"cases": [{name, expected, got, stderr, z, p, level, verdict, nonfinite, seconds, why}], "passed",
// "failed"}
nlohmann::ordered_json table_json(const std::vector<ValidateCase>& cases);

}  // namespace ls::cli
