// The states of a job, as the farm decides them and as users see them.
#pragma once

#include <string_view>

namespace ls::coordinator {

// queued: nothing of it has been leased yet. The last three are ends; only `done` can be extended.
enum class JobState { queued, running, paused, done, failed, cancelled };
std::string_view to_string(JobState state);

// Why a job that is done went no further. The words of the report: "spp", "error", "time", "user".
enum class StopReason { spp, error, time, user };
std::string_view to_string(StopReason reason);

enum class WorkerState { connected, draining, lost, sick };
std::string_view to_string(WorkerState state);

}  // namespace ls::coordinator
