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

}  // namespace

JobId Service::unused_id_locked() const {
  JobId id = random_job_id();
  while (entries_.contains(id) || sequences_.contains(id)) id = random_job_id();
  return id;
}

tl::expected<JobId, Rejected> Service::submit(SubmitRequest request) {
  if (request.spec.frames) return submit_sequence(request);
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
  job.id = unused_id_locked();
  const EntryPtr entry = make_entry(std::move(job));
  if (on_disk()) {
    auto log = PartialLog::open(folder(entry->stored.id));
    if (!log) return tl::unexpected(rejected(log.error()));
    entry->log = std::move(*log);
  }
  entry->assembly.emplace(entry->grid, entry->stored.spec.target_error.has_value(),
                          aovs_of(entry->stored.settings));
  if (entry->stored.spec.reference) entry->truths.emplace(entry->assembly->film());
  if (const auto put = store_->put_job(entry->stored); !put) return tl::unexpected(rejected(put.error()));
  const JobId id = entry->stored.id;
  register_locked(entry);
  log_info(fmt::format("job={} name={}", id.value, entry->stored.name), "submitted");
  log_job(id, "submitted");
  publish_job_locked(*entry);
  run_locked(JobSubmitted{plan_of(entry->stored)});
  return id;
}

Result<void> Service::wait(const JobId& id) const {
  std::unique_lock lock(mutex_);
  std::vector<EntryPtr> awaited;
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end()) {
    awaited = sequence->second.frames;
  } else {
    const auto entry = entry_locked(id);
    if (!entry) return tl::unexpected(entry.error());
    awaited = {*entry};
  }
  ended_.wait(lock, [&] {
    return std::all_of(awaited.begin(), awaited.end(), [&](const EntryPtr& entry) {
      const JobState state = shown_state(*entry);
      return state == JobState::done || state == JobState::failed || state == JobState::cancelled;
    });
  });
  return {};
}

}  // namespace ls::coordinator
