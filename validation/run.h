// Runs cases of the table of `lightshaft validate`: measures each, and judges it by equivalence (the measured
// confidence interval must lie within a band around the answer).
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
  // Simulates a broken renderer, to test that each case fails for it: every value is multiplied by `gain`.
  // Statistical cases are then not rendered. They are judged by the expected mean of such a renderer, and the
  // standard error for which the case's number of paths is planned.
  std::optional<double> gain = {};
};

// Runs the cases and returns the lines of the report. A case whose channels differ has one line per channel.
// A scene that cannot be built gives a failed line.
std::vector<cli::ValidateCase> run_cases(const Table& table, const RunOptions& options);

// Runs one case, judged with the same error probability as when the whole table is run.
std::vector<cli::ValidateCase> run_case(const Table& table, std::size_t index, const RunOptions& options);

// Returns the probability with which each confidence interval of the table may miss the right answer.
double level_of(const Table& table);

bool asked_for(const std::string& id, const std::string& only);

}  // namespace ls::cases
