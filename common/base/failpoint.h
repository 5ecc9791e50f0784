// Failpoints: named steps of a unit (one range of samples of one tile) at which the chaos tests kill a
// process. With LIGHTSHAFT_KILL_AT=STEP or STEP:N in the environment, the process kills itself by SIGKILL
// when it reaches the step (for the N-th time). Otherwise a failpoint costs one comparison.
#pragma once

#include <string_view>

namespace ls {

// The names of all steps, in the order in which a unit passes through them.
inline constexpr std::string_view kSteps[] = {
    // Steps of the worker are lease-received to result-sent, and acknowledged-seen. The others are the
    // coordinator's.
    "lease-sent",        "lease-received",    "unit-rendered",    "result-sent",   "result-arrived",
    "result-checked",    "result-appended",   "result-durable",   "result-folded", "result-acknowledged",
    "acknowledged-seen", "checkpoint-stored", "snapshot-written", "image-written", "job-done",
};

void failpoint(std::string_view name);

}  // namespace ls
