// Runs an external program in its own process group, with a time limit, and keeps the end of its output for
// error messages.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "compare/schedule.h"

namespace ls::race {

struct Program {
  std::vector<std::string> command;  // the first word is searched for in PATH
  double most_seconds = 0;  // limit of wall time; then the program is killed with all its descendants
};
// Runs the program and returns its total cost: wall time from start to end, and CPU time of the program and
// of the children it waited for. Its input is empty; it gets our environment except variables that begin with
// LIGHTSHAFT_, which may hold tokens.
//   invalid_argument: it cannot be started, ended with an exit code other than 0, or was killed by a signal;
//   resource_exhausted: it ran for too long; failed_precondition: `stop` was set.
// The error's message has the last line that the program wrote.
Result<Cost> run_program(const Program& program, const Clock& clock, const std::atomic<bool>& stop);

}  // namespace ls::race
