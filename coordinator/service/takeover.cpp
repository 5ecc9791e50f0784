#include "coordinator/service/takeover.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/service/blob_watch.h"
#include "coordinator/service/core.h"

namespace ls::coordinator {
namespace {
// Time until the next attempt to take over a job if the blob store did not answer
constexpr Duration kTakeOverPause = std::chrono::seconds(5);
}  // namespace

void Takeover::look_for_moved_jobs() {
  JobStore::Moved moved = store_.moved();
  std::vector<Inheritance> inherited;
  {
    const auto core = core_.lock();
    core->driver.quarantine(moved.quarantined);
    std::erase_if(later_, [&](Inheritance& one) {
      if (clock_.now() < one.again) return false;
      inherited.push_back(std::move(one));
      return true;
    });
  }
  for (const JobId& id : moved.lost) writes_.push([this, id] { let_go(id); });
  for (JobStore::Inherited& one : moved.inherited) inherited.push_back({std::move(one)});
  for (Inheritance& one : inherited) writes_.push([this, one = std::move(one)] { take_over(one); });
}

// Drops a job that another coordinator owns now. The job's record in the store belongs to the new owner and
// must not be touched.
void Takeover::let_go(const JobId& id) {
  {
    const auto core = core_.lock();
    std::erase_if(later_, [&](const Inheritance& one) { return one.job.job.id == id; });
    const auto entry = core->jobs.find(id);
    if (!entry) return;
    log_warn(fmt::format("job={}", id.value),
             "this coordinator's lease on it has passed and another one has taken it over: dropped here");
    entry->removed = true;
    entry->finishing = 0;
    if (!entry->unloaded) core->driver.run(JobCancelled{id});
    if (!entry->unloaded) core->driver.run(JobForgotten{id});
    if (const auto shown = core->jobs.remove(entry)) core->publisher.job_moved(*shown, entry->stored.owner);
    core->ended.notify_all();
  }
  files_.remove_folder(id);
}

void Takeover::take_over(Inheritance inheritance) {
  StoredJob job = inheritance.job.job;
  // The lock is not held here, since the blob store may need the network.
  const auto missing = missing_blobs_of(job, blobs_);
  const auto core = core_.lock();
  const JobId id = job.id;
  if (!missing) {
    log_warn(fmt::format("job={}", id.value),
             "cannot be taken over now, and is tried again: " + missing.error().message);
    inheritance.again = clock_.now() + kTakeOverPause;
    later_.push_back(std::move(inheritance));
    return;
  }
  if (core->jobs.find(id)) return;
  // A folder that exists here is outdated: it is from an earlier time at which this coordinator owned the job
  files_.remove_folder(id);
  restore_.reopen_if_image_is_lost(job);
  const auto entry = restore_.add(*core, std::move(job), missing);
  core->records.log(
      id, fmt::format("taken over from coordinator {}, which is gone; what it had rendered since and not "
                      "written to a shared place is rendered again, to the same bits",
                      inheritance.job.from));
  if (!entry->broken.empty()) core->records.log(id, entry->broken);
  core->publisher.job(*entry);
  core->driver.run(Tick{});
}

}  // namespace ls::coordinator
