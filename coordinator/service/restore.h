// Gives stored jobs to the farm again: at a restart, when a job of another coordinator is taken over, and
// when a job that has ended is to go on. Images come from snapshots. Results that are not in the snapshot are
// folded again from the logs of partials (the encoded results of units).
#pragma once

#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/service/state/job_entry.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

struct Core;

class Restore {
 public:
  Restore(JobStore& store, const JobFiles& files, const BlobStore& blobs, const Clock& clock)
      : store_(store), files_(files), blobs_(blobs), clock_(clock) {}

  // Restores all jobs. One that cannot be restored is reported and left unchanged on disk; the others
  // continue.
  Result<void> restart(Core& core) const;
  // Adds a stored job. `missing` lists the blobs that it needs and the store lacks: it waits for them.
  EntryPtr add(Core& core, StoredJob job, const Result<std::vector<BlobRef>>& missing) const;
  // Loads a job that has ended.
  Result<void> wake(Core& core, JobEntry& entry) const;

 private:
  Result<void> take_up(Core& core, JobEntry& entry, const Result<std::vector<BlobRef>>& missing) const;
  // Opens the job's log and loads its folded image, without the results of quarantined workers.
  Result<void> load(Core& core, JobEntry& entry) const;
  JobRestored restored(Core& core, JobEntry& entry, JobState state) const;
  void take_up_records(Core& core, JobEntry& entry, JobRestored& event) const;

  JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  const Clock& clock_;
};

}  // namespace ls::coordinator
