// Runs cases: measures, and judges by equivalence.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/cases/case.h"
#include "cli/validate_case.h"

namespace ls::cases {

struct RunOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  bool quick = false;
  std::string only;                                         // prefix or glob of ids; empty: all
  std::function<void(const cli::ValidateCase&)> done = {};  // after each line of the table
  // Stands a broken renderer in for the real one, for the test that each case fails for it: every value comes
  // out as this many times the right one. Statistical cases are then judged by the figures that such a
  // renderer gives on average, without rendering, with the error that the case's paths are planned for.
  std::optional<double> gain = {};
};

// The lines of the report; a case whose channels differ has one for each. A scene that can't be built is a
// failed line.
std::vector<cli::ValidateCase> run_cases(const Table& table, const RunOptions& options);

// One of the table's cases, at the table's level.
std::vector<cli::ValidateCase> run_case(const Table& table, std::size_t index, const RunOptions& options);

// What each interval of the table may be wrong by, either way.
double level_of(const Table& table);

bool asked_for(const std::string& id, const std::string& only);

}  // namespace ls::cases
