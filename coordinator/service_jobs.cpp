// Jobs: submission and what users do to them.
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "common/base/log.h"
#include "coordinator/intake.h"
#include "coordinator/service_impl.h"

namespace ls::coordinator {
namespace {

JobId random_job_id() {
  std::random_device device;
  return {fmt::format("j-{:08x}", device())};
}

Rejected rejected(Error error) { return {std::move(error), {}}; }

tl::unexpected<Error> wrong_state(const JobId& id, JobState state, std::string_view what) {
  return fail(Errc::failed_precondition,
              fmt::format("job {} is {}: it cannot be {}", id.value, to_string(state), what));
}

}  // namespace

tl::expected<JobId, Rejected> Service::submit(SubmitRequest request) {
  auto intake = take_in(request, *blobs_);
  if (!intake) return tl::unexpected(std::move(intake.error()));
  if (const auto put = blobs_->put(intake->job.scene, std::as_bytes(std::span(intake->scene_json))); !put)
    return tl::unexpected(rejected(put.error()));
  StoredJob job = std::move(intake->job);
  job.submitted_unix = unix_now();

  const std::lock_guard lock(mutex_);
  if (entries_.size() >= limits::kMaxJobs)
    return tl::unexpected(
        rejected({Errc::resource_exhausted, fmt::format("{} jobs are kept already", entries_.size())}));
  do job.id = random_job_id();
  while (entries_.contains(job.id));
  const auto entry = make_entry(std::move(job), true);
  if (!entry) return tl::unexpected(rejected(entry.error()));
  (*entry)->assembly.emplace((*entry)->grid, (*entry)->stored.spec.target_error.has_value());
  if (const auto put = store_->put_job((*entry)->stored); !put) return tl::unexpected(rejected(put.error()));
  const JobId id = (*entry)->stored.id;
  entries_.emplace(id, *entry);
  order_.push_back(id);
  log_info(fmt::format("job={} name={}", id.value, (*entry)->stored.name), "submitted");
  log_job(id, "submitted");
  publish_job_locked(**entry);
  run_locked(JobSubmitted{plan_of((*entry)->stored)});
  return id;
}

Result<void> Service::cancel(const JobId& id) {
  const std::lock_guard lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  const JobState state = shown_state(**entry);
  if (state == JobState::cancelled) return {};
  if (state == JobState::done || state == JobState::failed || (*entry)->finishing != 0)
    return wrong_state(id, (*entry)->finishing ? JobState::done : state, "cancelled");
  run_locked(JobCancelled{id});
  return {};
}

Result<void> Service::pause(const JobId& id) {
  const std::lock_guard lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  const JobState state = shown_state(**entry);
  if (state == JobState::paused) return {};
  if ((state != JobState::queued && state != JobState::running) || (*entry)->finishing)
    return wrong_state(id, state, "paused");
  run_locked(JobPaused{id});
  return {};
}

Result<void> Service::resume(const JobId& id) {
  const std::lock_guard lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  if ((*entry)->finishing) {
    (*entry)->finishing = ++last_final_;
    (*entry)->trouble.clear();
    chores_.push([this, e = *entry, number = last_final_] { finish(e, number); });
    return {};
  }
  const JobState state = shown_state(**entry);
  if (state == JobState::queued || state == JobState::running) return {};
  if (state != JobState::paused) return wrong_state(id, state, "resumed");
  (*entry)->trouble.clear();
  run_locked(JobResumed{id});
  return {};
}

Result<void> Service::set_priority(const JobId& id, int priority) {
  if (std::abs(std::int64_t{priority}) > limits::kMaxPriority)
    return fail(Errc::invalid_argument, fmt::format("priority must be within +-{}", limits::kMaxPriority));
  const std::lock_guard lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  (*entry)->stored.spec.priority = priority;
  if (const auto put = store_->put_job((*entry)->stored); !put) return put;
  if (!(*entry)->dormant) run_locked(JobPriority{id, priority});
  publish_job_locked(**entry);
  return {};
}

Result<void> Service::extend(const JobId& id, std::uint64_t spp) {
  if (spp == 0 || spp > limits::kMaxSpp)
    return fail(Errc::invalid_argument,
                fmt::format("{} samples per pixel: it must be 1 to {}", spp, limits::kMaxSpp));
  const std::lock_guard lock(mutex_);
  const auto found = entry_locked(id);
  if (!found) return tl::unexpected(found.error());
  JobEntry& entry = **found;
  const JobState state = shown_state(entry);
  if (state == JobState::failed || state == JobState::cancelled) return wrong_state(id, state, "extended");
  const bool at_end = entry.finishing != 0 || state == JobState::done;
  const auto cut_by = [&](StopReason reason) { return at_end && entry.stored.stopped == reason; };
  const bool by_error = cut_by(StopReason::error), by_time = cut_by(StopReason::time);
  if (!entry.assembly) load_folded(entry);
  if (entry.dormant) {
    if (!entry.log) {
      auto log = PartialLog::open(folder(id));
      if (!log) return tl::unexpected(log.error());
      entry.log = std::move(*log);
    }
    auto restored = restored_locked(entry, JobState::done);
    if (!restored) return tl::unexpected(restored.error());
    entry.dormant = false;
    run_locked(std::move(*restored));
  }
  const std::uint64_t before = farm_.job(id).value_or(JobFigures{}).spp;
  const std::uint64_t finishing = std::exchange(entry.finishing, 0);
  if (at_end) entry.clock_zero = now() - from_seconds(entry.stored.totals.render_seconds);
  run_locked(JobExtended{id, spp});
  const auto after = farm_.job(id);
  // An image cut short by its target may have fewer samples than the limit that stays its `spp`.
  const bool taken = after && (after->spp != before || (at_end && after->state != JobState::done));
  if (!taken) {
    if (at_end) entry.clock_zero.reset();
    entry.finishing = finishing;
    return fail(
        Errc::invalid_argument,
        fmt::format("job {} has {} samples per pixel already; ask for a larger total", id.value, before));
  }
  if (by_error) entry.stored.spec.target_error.reset();
  if (by_time) entry.stored.spec.time.reset();
  entry.stored.spp = entry.stored.spec.spp = even_spp(spp);
  log_job(id, fmt::format("extended to {} samples per pixel", spp));
  if (const auto put = store_->put_job(entry.stored); !put) return put;
  publish_job_locked(entry);
  return {};
}

Result<void> Service::wait(const JobId& id) const {
  std::unique_lock lock(mutex_);
  const auto entry = entry_locked(id);
  if (!entry) return tl::unexpected(entry.error());
  ended_.wait(lock, [&] {
    const JobState state = shown_state(**entry);
    return state == JobState::done || state == JobState::failed || state == JobState::cancelled;
  });
  return {};
}

}  // namespace ls::coordinator
