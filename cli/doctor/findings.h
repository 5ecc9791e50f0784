// Judges the facts that `lightshaft doctor` has observed, by pure functions that return one finding for each
// check. The findings' names and statuses are part of the JSON output (docs/guide/command-line.md).
#pragma once

#include <string>
#include <vector>

#include "cli/doctor/facts.h"

namespace ls::cli {

enum class Status { ok, warning, problem };
std::string to_string(Status status);

struct Finding {
  std::string name;     // name of the check, such as "memory"
  std::string subject;  // the address or folder checked, if one check is made for several
  Status status = Status::ok;
  std::string what;
  std::string advice;  // what the user should do; empty: nothing
};

std::vector<Finding> judge_machine(const MachineFacts& facts);
// Judges the farm. `program_version` is this command's version, `numeric_class` this machine's numeric class.
std::vector<Finding> judge_farm(const FarmFacts& facts, const std::string& program_version,
                                const std::string& numeric_class);

Finding judge_joining(const JoiningFacts& facts);

Status worst(const std::vector<Finding>& findings);

// Returns by how many seconds, at least, the coordinator's clock is ahead of this machine's; negative if it
// is behind, 0 if the clocks may agree. The exact difference is unknown: the coordinator writes `date`, the
// header Date of its answer, in whole seconds, rounded down, at some time between the request (`asked_at`)
// and the answer (`answered_at`).
double clock_lead(double asked_at, double answered_at, std::int64_t date);

}  // namespace ls::cli
