// Jobs: how they are submitted, and what users do to them.
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "common/base/log.h"
#include "coordinator/admission/admission.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {
namespace {

// Returns a random job id of 32 bits; if `wide`, of 64 bits. That is for a store in which other coordinators
// make ids, too, and cannot be asked which they have used.
JobId random_job_id(bool wide) {
  std::random_device device;
  return {wide ? fmt::format("j-{:08x}{:08x}", device(), device()) : fmt::format("j-{:08x}", device())};
}

}  // namespace

JobId Service::unused_id_locked() const {
  JobId id = random_job_id(options_.shared);
  while (entries_.contains(id) || sequences_.contains(id)) id = random_job_id(options_.shared);
  return id;
}

// Returns an error if there is no room for `jobs` more jobs. The limit per user is lower than that for all,
// so that no single user can use up all jobs.
Result<void> Service::room_for_locked(const std::string& owner, std::size_t jobs) const {
  if (entries_.size() + jobs > limits::kMaxJobs)
    return fail(Errc::resource_exhausted,
                fmt::format("{} jobs are kept already, and {} more are more than {}", entries_.size(), jobs,
                            limits::kMaxJobs));
  if (owner.empty()) return {};
  const auto own =
      static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(), [&](const auto& entry) {
        return entry.second->stored.owner == owner;
      }));
  if (own + jobs <= limits::kMaxJobsOfUser) return {};
  return fail(
      Errc::resource_exhausted,
      fmt::format(
          "{} jobs of user {} are kept already, and {} more are more than {}: remove some that are done", own,
          owner, jobs, limits::kMaxJobsOfUser));
}

tl::expected<JobId, Rejected> Service::submit(SubmitRequest request) {
  if (request.spec.denoise)
    if (const auto possible = denoising_.available(); !possible)
      return tl::unexpected(Rejected{possible.error(), {}});
  if (request.spec.frames) return submit_sequence(request);
  const auto in_use = blobs_->in_use();
  auto admission = admit(request, *blobs_);
  if (!admission) return tl::unexpected(std::move(admission.error()));
  if (const auto put = blobs_->put(admission->job.scene, std::as_bytes(std::span(admission->scene_json)));
      !put)
    return tl::unexpected(Rejected{put.error(), {}});
  StoredJob job = std::move(admission->job);
  job.submitted_unix = unix_now();

  const std::lock_guard lock(mutex_);
  if (auto room = room_for_locked(job.owner, 1); !room) return tl::unexpected(Rejected{room.error(), {}});
  job.id = unused_id_locked();
  const EntryPtr entry = make_entry(std::move(job));
  if (on_disk()) {
    auto log = PartialLog::open(folder(entry->stored.id));
    if (!log) return tl::unexpected(Rejected{log.error(), {}});
    entry->log = std::move(*log);
  }
  entry->assembly.emplace(entry->grid, entry->stored.spec.target_error.has_value(),
                          aovs_of(entry->stored.settings));
  if (entry->stored.spec.reference) entry->reference_tiles.emplace(entry->assembly->film());
  if (const auto put = store_->put_job(entry->stored); !put) return tl::unexpected(Rejected{put.error(), {}});
  const JobId id = entry->stored.id;
  register_locked(entry);
  log_info(fmt::format("job={} name={}", id.value, log_value(entry->stored.name)), "submitted");
  log_job(id, "submitted");
  publish_job_locked(*entry);
  run_locked(JobSubmitted{plan_of(entry->stored)});
  return id;
}

Result<void> Service::wait(const JobId& id) const {
  std::unique_lock lock(mutex_);
  std::vector<EntryPtr> missing_blobs;
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end()) {
    missing_blobs = sequence->second.frames;
  } else {
    const auto entry = entry_locked(id);
    if (!entry) return tl::unexpected(entry.error());
    missing_blobs = {*entry};
  }
  ended_.wait(lock, [&] {
    return std::all_of(missing_blobs.begin(), missing_blobs.end(), [&](const EntryPtr& entry) {
      return entry->removed || is_terminal(shown_state(*entry));
    });
  });
  return {};
}

}  // namespace ls::coordinator
