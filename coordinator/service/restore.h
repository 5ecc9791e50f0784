// Adds stored jobs to the farm again: at a restart, when a job of another coordinator is taken over, and when
// an ended job is extended. Images come from snapshots (files with the image so far). Results that a snapshot
// does not contain are read from the logs of partials (the encoded results of units) and added to the image
// again.
#pragma once

#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/job_table.h"
#include "coordinator/service/state/records.h"
#include "coordinator/store/blobs/blob_store.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

struct Core;

class Restore {
 public:
  Restore(JobStore& store, const JobFiles& files, const BlobStore& blobs, const Clock& clock)
      : store_(store), files_(files), blobs_(blobs), clock_(clock) {}

  // Restores all jobs. A job that cannot be restored is reported and left unchanged on disk; the others
  // continue.
  Result<void> restart(Core& core) const;
  // If the image of a done job is lost, sets the job back to `queued`, so that it is rendered again.
  void reopen_if_image_is_lost(StoredJob& job) const;
  // Adds a stored job. `missing` lists the blobs that it needs but the store lacks; the job waits for them.
  EntryPtr add(Core& core, StoredJob job, const Result<std::vector<BlobRef>>& missing) const;
  // Loads a job that has ended, so that it can be extended.
  Result<void> wake(Core& core, JobEntry& entry) const;

 private:
  Result<void> take_up(Core& core, JobEntry& entry, const Result<std::vector<BlobRef>>& missing) const;
  // Opens the job's log and loads its image so far, without the results of quarantined workers.
  Result<void> load(Core& core, JobEntry& entry) const;
  JobRestored restored(Core& core, JobEntry& entry, JobState state) const;
  void take_up_records(Core& core, JobEntry& entry, JobRestored& event) const;

  JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  const Clock& clock_;
};

// Used if several coordinators share a job store: takes over the jobs of a coordinator that is gone, and
// drops jobs that another coordinator has taken over from this one (store/redis/redis_members.h). Both happen
// on the writer thread, after the earlier writes of these jobs.
class Takeover {
 public:
  Takeover(Guarded<Core>& core, JobStore& store, const JobFiles& files, const BlobStore& blobs,
           const Restore& restore, BackgroundWrites& writes, const Clock& clock)
      : core_(core),
        store_(store),
        files_(files),
        blobs_(blobs),
        restore_(restore),
        writes_(writes),
        clock_(clock) {}

  // Asks the job store which jobs have changed their coordinator, and queues their takeover or removal on the
  // writer thread.
  void look_for_moved_jobs();

 private:
  struct Inheritance {
    JobStore::Inherited job;
    TimePoint again{};  // time of the next attempt, if an earlier one failed
  };
  void take_over(Inheritance inheritance);
  void let_go(const JobId& id);

  Guarded<Core>& core_;
  JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  const Restore& restore_;
  BackgroundWrites& writes_;
  const Clock& clock_;
  std::vector<Inheritance> later_;  // jobs whose takeover is repeated later; guarded by the lock
};

}  // namespace ls::coordinator
