// Runs cases of the table of `lightshaft validate`: measures each, and judges it. A statistical case is
// judged by equivalence: the confidence interval of its mean must lie within a band around the answer.
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
  std::string only;                                         // a prefix or glob of the ids to run; empty: all
  std::function<void(const cli::ValidateCase&)> done = {};  // called with each line of the table
  // If set, simulates a broken renderer whose values are all multiplied by `gain`, to test that each case
  // fails for it. Statistical cases are then not rendered: they are judged by `gain` times their answer, with
  // the standard error for which the number of paths of the case is planned.
  std::optional<double> gain = {};
};

// Runs the cases and returns the lines of the report. A case that judges each channel has one line per
// channel. A scene that cannot be built gives a failed line.
std::vector<cli::ValidateCase> run_cases(const Table& table, const RunOptions& options);

// Runs the case at `index` of the table. It is judged with the same error probability as when the whole table
// is run.
std::vector<cli::ValidateCase> run_case(const Table& table, std::size_t index, const RunOptions& options);

// Returns the probability with which each confidence interval of the table may miss the right answer.
double level_of(const Table& table);

bool asked_for(const std::string& id, const std::string& only);

}  // namespace ls::cases
