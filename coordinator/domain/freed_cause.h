// Why a worker no longer has a unit that was lent to it, though it has not handed in its result.
#pragma once

#include <string_view>
#include <utility>

namespace ls::coordinator {

enum class FreedCause {
  worker_lost,
  newer_stream,  // its worker has connected again
  deadline_passed,
  returned,        // by a worker that drains, or that could not load the job
  failed,          // on this worker
  moved,           // from behind other work of its worker to one that had none
  paused,          // the job
  round_reopened,  // an extension renders it again with more samples
  worker_barred,
  not_wanted,  // beyond the round in which its tile has ended: nobody renders it again
  job_ended    // it failed or was cancelled: nobody renders it again
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
    {FreedCause::worker_barred, "worker barred"},
    {FreedCause::not_wanted, "not wanted"},
    {FreedCause::job_ended, "job ended"}};

constexpr std::string_view to_string(FreedCause cause) {
  for (const auto& [one, word] : kFreedCauses)
    if (one == cause) return word;
  return "";
}

}  // namespace ls::coordinator
