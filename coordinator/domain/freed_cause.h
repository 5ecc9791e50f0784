// Why a unit (one round of one tile) left a worker's lease without a result.
#pragma once

#include <string_view>
#include <utility>

namespace ls::coordinator {

enum class FreedCause {
  worker_lost,
  newer_stream,  // the worker has connected again
  deadline_passed,
  returned,        // the worker returned it, since it is draining or could not load the job
  failed,          // the worker failed to render it
  moved,           // it waited behind other work of its worker and is given to an idle worker
  paused,          // the job was paused
  round_reopened,  // the job was extended, and the round is rendered again with more samples
  worker_quarantined,
  not_wanted,  // its tile has ended with an earlier round: it is not rendered again
  job_ended    // the job failed or was cancelled: it is not rendered again
};
inline constexpr std::pair<FreedCause, std::string_view> kFreedCauses[] = {
    {FreedCause::worker_lost, "worker lost"},
    {FreedCause::newer_stream, "replaced by a newer stream"},
    {FreedCause::deadline_passed, "deadline passed"},
    {FreedCause::returned, "returned"},
    {FreedCause::failed, "failed"},
    {FreedCause::moved, "moved to an idle worker"},
    {FreedCause::paused, "job paused"},
    {FreedCause::round_reopened, "round reopened"},
    {FreedCause::worker_quarantined, "worker quarantined"},
    {FreedCause::not_wanted, "not wanted"},
    {FreedCause::job_ended, "job ended"}};

constexpr std::string_view to_string(FreedCause cause) {
  for (const auto& [one, word] : kFreedCauses)
    if (one == cause) return word;
  return "";
}

}  // namespace ls::coordinator
