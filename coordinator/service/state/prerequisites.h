// Jobs that wait for other jobs to be done (JobSpec::after). A prerequisite is a job, a sequence or a frame.
// A sequence is done when all its frames are.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coordinator/service/state/job_table.h"

namespace ls::coordinator {

// Returns the state of a job, frame or sequence as others wait for it: of a sequence `failed` or `cancelled`
// as soon as one frame is. nullopt: there is no such job here.
std::optional<JobState> prerequisite_state(const JobTable& jobs, const JobId& id);

// Returns what a new job, or one that is changed, has to wait for; prerequisites that are done are left out.
// `frames`: the numbers of its frames, for each of which the result has a list; empty: a single image, with
// one list. Each is named once. A frame waits for the frame of its number in sequences of the same frames,
// and for the whole of others. Unknown jobs, and those that have failed or were cancelled, are errors.
Result<std::vector<std::vector<std::string>>> prerequisites_of(const JobTable& jobs,
                                                               std::span<const std::string> after,
                                                               std::span<const std::uint32_t> frames);
// Returns an error if one of these prerequisites waits for `job` itself, directly or by way of others.
Result<void> check_no_cycle(const JobTable& jobs, const JobId& job, std::span<const std::string> after);

// Describes for a job's view the jobs that it waits for. `held`: only a user can end the wait.
struct Waiting {
  std::vector<AfterView> after;
  std::string words;
  bool held = false;
};
Waiting waiting_of(const JobTable& jobs, const StoredJob& job);

}  // namespace ls::coordinator
