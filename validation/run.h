// Runs cases: measures, and judges by equivalence.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "validation/fixtures/case.h"
#include "validation/measure/judge.h"

namespace ls::cases {

struct RunOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  bool quick = false;
  std::string only;                                         // prefix or glob of ids; empty: all
  std::function<void(const cli::ValidateCase&)> done = {};  // called after each line of the table
  // Simulates a broken renderer, to test that each case fails for it: every value is multiplied by this.
  // Statistical cases are then judged by the figures that such a renderer gives on average, without
  // rendering, with the error that the case's paths are planned for.
  std::optional<double> gain = {};
};

// The lines of the report; a case whose channels differ has one per channel. A scene that cannot be built
// gives a failed line.
std::vector<cli::ValidateCase> run_cases(const Table& table, const RunOptions& options);

// One of the table's cases, at the table's level.
std::vector<cli::ValidateCase> run_case(const Table& table, std::size_t index, const RunOptions& options);

// The error probability, on either side, of each interval of the table.
double level_of(const Table& table);

bool asked_for(const std::string& id, const std::string& only);

}  // namespace ls::cases
