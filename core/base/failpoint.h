// Failpoints: named steps in the processing of a unit, at which the chaos tests kill a process. If the
// environment has LIGHTSHAFT_KILL_AT=STEP or LIGHTSHAFT_KILL_AT=STEP:N, the process kills itself by SIGKILL
// when it reaches that step for the first or the N-th time. Without the variable a failpoint costs one
// comparison.
#pragma once

#include <string_view>

namespace ls {

// The names of all steps, in the order in which a unit passes through them.
inline constexpr std::string_view kSteps[] = {
    // The coordinator hands a unit to a worker by a lease. The worker's steps are those from lease-received
    // to result-sent, and acknowledged-seen. All others are the coordinator's.
    "lease-sent",        "lease-received",    "unit-rendered",    "result-sent",   "result-arrived",
    "result-checked",    "result-appended",   "result-durable",   "result-folded", "result-acknowledged",
    "acknowledged-seen", "checkpoint-stored", "snapshot-written", "image-written", "job-done",
};

void failpoint(std::string_view name);

}  // namespace ls
