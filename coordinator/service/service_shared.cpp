// Several coordinators on one store: jobs taken over from a coordinator that is gone, and jobs lost to
// another one (store/redis/redis_members.h).
#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {
namespace {
// Time until a job is tried again for which the blob store did not answer
constexpr Duration kTakeOverPause = std::chrono::seconds(5);
}  // namespace

void Service::announce(const std::string& http, const std::string& grpc) { store_->announce(http, grpc); }

Result<std::optional<JobLocation>> Service::locate_job(const JobId& id) { return store_->locate_job(id); }

// Takes over jobs of coordinators that are gone, and drops those that another coordinator owns now. Both
// happen on the writer thread, after earlier writes of these jobs.
void Service::look_for_moved_jobs() {
  if (!options_.shared) return;
  JobStore::Moved moved = store_->moved();
  std::vector<Inheritance> inherited;
  {
    const std::lock_guard lock(mutex_);
    apply_quarantine_locked(moved.quarantined);
    std::erase_if(inherited_, [&](Inheritance& one) {
      if (now() < one.again) return false;
      inherited.push_back(std::move(one));
      return true;
    });
  }
  for (const JobId& id : moved.lost) background_writes_.push([this, id] { let_go(id); });
  for (JobStore::Inherited& one : moved.inherited) inherited.push_back({std::move(one)});
  for (Inheritance& one : inherited)
    background_writes_.push([this, one = std::move(one)] { take_over(one); });
}

// Drops a job that another coordinator owns now. The job's record in the store belongs to that one and must
// not be touched.
void Service::let_go(const JobId& id) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(inherited_, [&](const Inheritance& one) { return one.job.job.id == id; });
    const auto entry = find_locked(id);
    if (!entry) return;
    log_warn(fmt::format("job={}", id.value),
             "this coordinator's lease on it has passed and another one has taken it over: dropped here");
    entry->removed = true;
    entry->finishing = 0;
    if (!entry->unloaded) run_locked(JobCancelled{id});
    if (!entry->unloaded) run_locked(JobForgotten{id});
    entries_.erase(id);
    leave_sequence_locked(entry);
    ended_.notify_all();
  }
  if (on_disk()) {
    std::error_code error;
    std::filesystem::remove_all(folder(id), error);
  }
}

void Service::leave_sequence_locked(const EntryPtr& entry) {
  JobId shown = entry->stored.id;
  if (const auto frame = frame_of(shown)) {
    shown = frame->sequence;
    const auto sequence = sequences_.find(shown);
    if (sequence == sequences_.end()) return;
    std::erase(sequence->second.frames, entry);
    if (!sequence->second.frames.empty()) return;
    sequences_.erase(sequence);
  }
  std::erase(order_, shown);
  hub_->publish("job", job_moved_json(shown), shown.value, entry->stored.owner);
}

void Service::take_over(Inheritance inheritance) {
  StoredJob job = inheritance.job.job;
  // This is done without the lock, since the blob store may need the network.
  const auto missing = missing_blobs_of(job);
  if (!missing) {
    log_warn(fmt::format("job={}", job.id.value),
             "cannot be taken over now, and is tried again: " + missing.error().message);
    const std::lock_guard lock(mutex_);
    inheritance.again = now() + kTakeOverPause;
    inherited_.push_back(std::move(inheritance));
    return;
  }
  const std::lock_guard lock(mutex_);
  if (entries_.contains(job.id)) return;
  if (on_disk()) {  // local files are of a time when this coordinator owned the job before: they are outdated
    std::error_code error;
    std::filesystem::remove_all(folder(job.id), error);
  }
  for (const WorkerId& worker : job.distrusted)
    apply_quarantine_locked({{worker, fmt::format("it rendered wrong pixels of job {}", job.id.value)}});
  if (image_is_lost(job)) begin_again(job);
  const JobState state = job.state;
  const JobId id = job.id;
  const auto entry = make_entry(std::move(job));
  entry->unloaded = is_terminal(state);
  restoring_ = true;
  register_locked(entry);
  if (auto taken = take_up_locked(*entry, state, missing); !taken) set_aside_locked(*entry, taken.error());
  restoring_ = false;
  log_job(id, fmt::format("taken over from coordinator {}, which is gone; what it had rendered since and not "
                          "written to a shared place is rendered again, to the same bits",
                          inheritance.job.from));
  if (!entry->broken.empty()) log_job(id, entry->broken);
  publish_job_locked(*entry);
  run_locked(Tick{});
}

}  // namespace ls::coordinator
