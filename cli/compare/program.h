// Running a program that is not ours: in a process group of its own, with an end to our patience, and with
// the last that it said for the message when it fails.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "cli/compare/schedule.h"
#include "common/base/clock.h"
#include "common/base/error.h"

namespace ls::race {

struct Program {
  std::vector<std::string> command;  // the first is looked for in PATH
  double most_seconds = 0;           // of wall time; then it is killed with all that it started
};
// What it cost as a whole: wall time from start to end, CPU time of it and of what it waited for. Its input
// is empty; it sees our environment but for what begins with LIGHTSHAFT_, where tokens are.
//   invalid_argument: it cannot be started, ended with another exit code than 0, or died;
//   resource_exhausted: it ran for too long; failed_precondition: `stop` was seen.
// The message has the last line that it wrote.
Result<Cost> run_program(const Program& program, const Clock& clock, const std::atomic<bool>& stop);

}  // namespace ls::race
