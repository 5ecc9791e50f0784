// Adds stored jobs to the farm again: at a restart, when a job of another coordinator is taken over, and when
// an ended job is extended. Images come from snapshots (files with the image so far). Results that a snapshot
// does not contain are read from the logs of partials (the encoded results of units) and added to the image
// again.
#pragma once

#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/job_table.h"
#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

struct Core;

class Restore {
 public:
  Restore(JobStore& store, const JobFiles& files, const BlobStore& blobs, const Clock& clock)
      : store_(store), files_(files), blobs_(blobs), clock_(clock) {}

  // Restores all jobs. A job that cannot be restored is reported and left unchanged on disk; the others
  // continue.
  Result<void> restart(Core& core) const;
  // If the image of a done job is lost, sets the job back so that it is rendered again.
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

}  // namespace ls::coordinator
