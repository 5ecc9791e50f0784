// Why a unit left a worker's lease without a result.
#pragma once

#include <string_view>
#include <utility>

namespace ls::coordinator {

enum class FreedCause {
  worker_lost,
  newer_stream,  // the worker has connected again
  deadline_passed,
  returned,        // by a worker that is draining or could not load the job
  failed,          // on this worker
  moved,           // from behind other work of its worker to an idle worker
  paused,          // the job was paused
  round_reopened,  // an extension renders it again with more samples
  worker_quarantined,
  not_wanted,  // beyond the round in which its tile ended: not rendered again
  job_ended    // the job failed or was cancelled: not rendered again
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
    {FreedCause::worker_quarantined, "worker barred"},
    {FreedCause::not_wanted, "not wanted"},
    {FreedCause::job_ended, "job ended"}};

constexpr std::string_view to_string(FreedCause cause) {
  for (const auto& [one, word] : kFreedCauses)
    if (one == cause) return word;
  return "";
}

}  // namespace ls::coordinator
