// Changes that users make to jobs. Every change is checked completely before any part of it is applied.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/base/log.h"
#include "common/job/limits.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {
namespace {

std::string_view done_to_become(JobState asked) {
  if (asked == JobState::paused) return "paused";
  return asked == JobState::running ? "resumed" : "cancelled";
}

}  // namespace

Result<void> check_priority(int priority) {
  if (std::abs(std::int64_t{priority}) > kMaxPriority)
    return fail(Errc::invalid_argument, fmt::format("priority must be within +-{}", kMaxPriority));
  return {};
}

Result<void> Service::change(const JobId& id, const JobChange& change) {
  const std::lock_guard lock(mutex_);
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end())
    return change_sequence_locked(id, sequence->second, change);
  const auto entry = usable_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  if (change.priority)
    if (auto ok = check_priority(*change.priority); !ok) return ok;
  if (change.state)
    if (auto ok = may_become_locked(**entry, *change.state, change.spp || change.target_error); !ok)
      return ok;
  if (change.spp && change.target_error)
    return fail(Errc::invalid_argument,
                "samples (spp) and target_error cannot be changed at once: one decides "
                "how far the job goes; change one, then the other");
  // These functions check first; if one fails, nothing has been changed.
  if (change.spp)
    if (auto done = extend_locked(**entry, *change.spp); !done) return done;
  if (change.target_error)
    if (auto done = set_target_locked(**entry, *change.target_error); !done) return done;
  if (change.priority)
    if (auto done = set_priority_locked(**entry, *change.priority); !done) return done;
  return change.state ? become_locked(*entry, *change.state) : Result<void>{};
}

Result<void> Service::cancel(const JobId& id) { return change(id, {JobState::cancelled, {}, {}, {}}); }
Result<void> Service::pause(const JobId& id) { return change(id, {JobState::paused, {}, {}, {}}); }
Result<void> Service::resume(const JobId& id) { return change(id, {JobState::running, {}, {}, {}}); }
Result<void> Service::set_priority(const JobId& id, int priority) {
  return change(id, {{}, priority, {}, {}});
}
Result<void> Service::extend(const JobId& id, std::uint64_t spp) { return change(id, {{}, {}, spp, {}}); }

Result<void> Service::may_become_locked(const JobEntry& entry, JobState asked, bool extended) const {
  JobState state = shown_state(entry);
  const bool finishing = entry.finishing != 0 && !extended;
  if (extended && state == JobState::done) state = JobState::running;
  if (state == asked && !finishing) return {};
  const bool possible =
      asked == JobState::running ? !is_terminal(state) || finishing : !is_terminal(state) && !finishing;
  if (possible) return {};
  return fail(Errc::failed_precondition,
              fmt::format("job {} is {}: it cannot be {}", entry.stored.id.value,
                          to_string(finishing ? JobState::done : state), done_to_become(asked)));
}

Result<void> Service::become_locked(const EntryPtr& entry, JobState asked) {
  const JobId& id = entry->stored.id;
  const JobState state = shown_state(*entry);
  if (asked == JobState::cancelled) {
    if (state != asked) run_locked(JobCancelled{id});
  } else if (asked == JobState::paused) {
    entry->stored.missing_blobs.clear();  // from now on the job is paused by its user
    if (state != asked)
      run_locked(JobPaused{id});
    else
      persist_locked(*entry);
  } else if (entry->finishing) {  // its final image could not be written: this is tried again
    entry->finishing = ++last_final_;
    entry->trouble.clear();
    background_writes_.push([this, entry, number = last_final_] { finish(entry, number); });
  } else if (state == JobState::paused) {
    if (auto saved = save_pin_locked(*entry); !saved) return saved;
    if (auto saved = save_quarantined_locked(); !saved) return saved;
    entry->trouble.clear();
    ++entry->resumes;
    run_locked(JobResumed{id});
  }
  return {};
}

Result<void> Service::set_priority_locked(JobEntry& entry, int priority) {
  const int before = std::exchange(entry.stored.spec.priority, priority);
  if (auto put = store_->put_job(entry.stored); !put) {
    entry.stored.spec.priority = before;
    return put;
  }
  if (!entry.unloaded) run_locked(JobPriority{entry.stored.id, priority});
  publish_job_locked(entry);
  return {};
}

// Applies an extension (more samples or a tighter target) to the farm and to the stored job.
Result<void> Service::go_on_locked(JobEntry& entry, const Result<void>& possible, const Event& change,
                                   std::string log_line) {
  const JobState state = shown_state(entry);
  if (!possible) {
    if (state == JobState::done && !entry.finishing) forget_locked(entry);
    return possible;
  }
  const JobId id = entry.stored.id;
  const auto spp = entry.stored.spp;
  const bool at_end = entry.finishing != 0 || state == JobState::done;
  if (at_end) entry.clock_zero = now() - from_seconds(entry.stored.totals.render_seconds);
  entry.finishing = 0;
  run_locked(change);
  const JobPlan plan = farm_.plan(id).value();
  entry.stored.spec.target_error = plan.target_error;
  entry.stored.spec.time = plan.time;
  if (plan.spp != spp) entry.stored.spp = entry.stored.spec.spp = plan.spp;
  log_job(id, std::move(log_line));
  if (const auto put = store_->put_job(entry.stored); !put) return put;
  publish_job_locked(entry);
  return {};
}

Result<void> Service::set_target_locked(JobEntry& entry, double target_error) {
  const JobId id = entry.stored.id;
  const JobState state = shown_state(entry);
  if (state == JobState::failed || state == JobState::cancelled)
    return fail(Errc::failed_precondition,
                fmt::format("job {} is {}: its target error can no longer be changed; submit it again",
                            id.value, to_string(state)));
  if (auto woken = wake_locked(entry); !woken) return woken;
  auto possible = farm_.may_retarget(id, target_error);
  if (possible) {
    const auto before = std::exchange(entry.stored.spec.target_error, target_error);
    possible = store_->put_job(entry.stored);
    if (!possible) entry.stored.spec.target_error = before;
  }
  return go_on_locked(entry, possible, JobRetargeted{id, target_error},
                      fmt::format("target error {} from now on", target_error));
}

Result<void> Service::wake_locked(JobEntry& entry) {
  if (!entry.unloaded) return {};
  if (auto loaded = load_locked(entry); !loaded) return loaded;
  auto restored = restored_locked(entry, JobState::done);
  if (!restored) return tl::unexpected(restored.error());
  entry.unloaded = false;
  restoring_ = true;  // folds that are replayed because the film is lost publish no events
  run_locked(std::move(*restored));
  restoring_ = false;
  entry.replay_at.clear();
  return {};
}

Result<void> Service::extend_locked(JobEntry& entry, std::uint64_t spp) {
  if (spp == 0 || spp > limits::kMaxSpp)
    return fail(Errc::invalid_argument,
                fmt::format("{} samples per pixel: it must be 1 to {}", spp, limits::kMaxSpp));
  const JobId id = entry.stored.id;
  const JobState state = shown_state(entry);
  if (state == JobState::failed || state == JobState::cancelled)
    return fail(Errc::failed_precondition,
                fmt::format("job {} is {}: it cannot be extended", id.value, to_string(state)));
  if (auto woken = wake_locked(entry); !woken) return woken;
  return go_on_locked(entry, farm_.may_extend(id, spp), JobExtended{id, spp},
                      fmt::format("extended to {} samples per pixel", spp));
}

Result<void> Service::remove(const JobId& id) {
  const std::lock_guard lock(mutex_);
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end())
    return remove_sequence_locked(id, sequence->second);
  const auto found = entry_locked(id);
  if (!found) return tl::unexpected(found.error());
  const EntryPtr entry = *found;
  if (const auto frame = frame_of(id))
    return fail(Errc::failed_precondition,
                fmt::format("{} is a frame of job {}: it can be cancelled, and is removed with all frames",
                            id.value, frame->sequence.value));
  if (!is_terminal(shown_state(*entry)) && entry->finishing == 0) {
    run_locked(JobCancelled{id});
    return {};
  }
  if (auto removed = store_->remove_job(id); !removed) return removed;
  std::erase(order_, id);
  drop_locked(entry);
  hub_->publish("job", job_removed_json(id), id.value, entry->stored.owner);
  return {};
}

// Drops the job from memory, after its record in the store was removed.
void Service::drop_locked(const EntryPtr& entry) {
  const JobId id = entry->stored.id;
  entry->removed = true;
  entry->finishing = 0;
  if (!entry->unloaded) run_locked(JobForgotten{id});
  entries_.erase(id);
  log_info(fmt::format("job={}", id.value), "removed");
  // Background writes of the job may still be queued; what they leave behind is removed with the folder.
  background_writes_.push([this, id] {
    (void)store_->remove_job(id);
    if (!on_disk()) return;
    auto gone = folder(id);
    gone += kRemovedExtension;
    std::error_code error;
    std::filesystem::rename(folder(id), gone, error);
    if (!error) std::filesystem::remove_all(gone, error);
    if (error && error != std::errc::no_such_file_or_directory)
      log_warn(fmt::format("job={}", id.value), "its folder cannot be removed: " + error.message());
  });
}

}  // namespace ls::coordinator
