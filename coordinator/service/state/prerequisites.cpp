#include "coordinator/service/state/prerequisites.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace ls::coordinator {
namespace {

JobId whole_of(const JobId& id) {
  const auto frame = frame_of(id);
  return frame ? frame->sequence : id;
}

std::vector<std::uint32_t> numbers_of(const Sequence& sequence) {
  std::vector<std::uint32_t> numbers;
  for (const EntryPtr& frame : sequence.frames) numbers.push_back(frame_of(frame->stored.id)->frame);
  return numbers;
}

}  // namespace

std::optional<JobState> prerequisite_state(const JobTable& jobs, const JobId& id) {
  if (const Sequence* sequence = jobs.sequence(id)) return sequence->for_others();
  const EntryPtr entry = jobs.find(id);
  return entry ? std::optional(entry->stored.state) : std::nullopt;
}

Result<std::vector<std::vector<std::string>>> prerequisites_of(const JobTable& jobs,
                                                               std::span<const std::string> after,
                                                               std::span<const std::uint32_t> frames) {
  std::vector<std::vector<std::string>> lists(std::max<std::size_t>(1, frames.size()));
  for (const std::string& name : after) {
    const JobId id{name};
    const auto state = prerequisite_state(jobs, id);
    if (!state) return fail(Errc::invalid_argument, fmt::format("after: there is no job {}", name));
    if (is_closed(*state))
      return fail(Errc::failed_precondition,
                  fmt::format("after: job {} is {} and will never be done: submit it again, and name the new "
                              "job here",
                              name, to_string(*state)));
    const Sequence* sequence = jobs.sequence(id);
    const bool paired = sequence && !frames.empty() && std::ranges::equal(numbers_of(*sequence), frames);
    for (std::size_t i = 0; i < lists.size(); ++i) {
      const JobId one = paired ? frame_job(id, frames[i]) : id;
      if ((paired ? prerequisite_state(jobs, one) : state) == JobState::done) continue;
      if (std::ranges::find(lists[i], one.value) == lists[i].end()) lists[i].push_back(one.value);
    }
  }
  return lists;
}

Result<void> check_no_cycle(const JobTable& jobs, const JobId& job, std::span<const std::string> after) {
  std::set<JobId> seen;
  std::vector<JobId> next;
  for (const std::string& name : after) next.push_back(whole_of({name}));
  while (!next.empty()) {
    const JobId one = std::move(next.back());
    next.pop_back();
    if (one == whole_of(job))
      return fail(Errc::invalid_argument,
                  fmt::format("after: job {} would wait for itself: {} waits for it, directly or by way of "
                              "other jobs",
                              job.value, after.front()));
    if (!seen.insert(one).second) continue;
    const auto entries = jobs.job_or_frames(one);
    if (!entries) continue;
    for (const EntryPtr& entry : *entries)
      for (const std::string& name : entry->stored.spec.after) next.push_back(whole_of({name}));
  }
  return {};
}

Waiting waiting_of(const JobTable& jobs, const StoredJob& job) {
  Waiting out;
  if (is_terminal(job.state)) return out;
  for (const std::string& name : job.spec.after) {
    const auto state = prerequisite_state(jobs, {name});
    out.after.push_back({{name}, state});
    const bool never = !state || is_closed(*state);
    if (out.held || (!never && !out.words.empty())) continue;
    out.held = never;
    out.words =
        never ? fmt::format(
                    "job {}, for which it waits, {}: name another one (lightshaft after {} JOB), let it "
                    "go without (lightshaft after {}), or cancel it",
                    name,
                    !state                          ? "is not here any more"
                    : *state == JobState::cancelled ? "was cancelled"
                                                    : "failed",
                    job.id.value, job.id.value)
              : fmt::format("waits for job {}, which is {}", name, to_string(*state));
  }
  return out;
}

}  // namespace ls::coordinator
