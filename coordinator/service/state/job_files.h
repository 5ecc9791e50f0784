// The folders of jobs in --data: DATA/jobs/ID has the partial log, the snapshot film.snap, and of a done job
// image.exr and report.json. There are none if everything is in memory. It has no state that changes, so
// it is used by several threads.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/snapshot.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

class JobFiles {
 public:
  // `data`: empty if everything is in memory
  JobFiles(std::filesystem::path data, bool shared) : data_(std::move(data)), shared_(shared) {}

  bool on_disk() const { return !data_.empty(); }
  std::filesystem::path folder(const JobId& id) const { return data_ / "jobs" / id.value; }
  void remove_folder(const JobId& id) const;
  // Removes the folder of a job that was removed. It is renamed first, so that a crash leaves nothing that
  // looks like a job.
  void discard_folder(const JobId& id) const;
  void remove_discarded() const;  // what a crash has left of discard_folder()
  // If other coordinators share the store, removes what is left here of jobs that they have taken over. A
  // finished image stays.
  void remove_unknown(const std::vector<StoredJob>& jobs) const;

  // Creates the job's snapshot, under this suffix until it is committed.
  Result<SnapshotFile> create_snapshot(const StoredJob& job, const TileGrid& grid,
                                       std::string_view suffix) const;
  // Returns the image of the snapshot; one without samples if there is none.
  Assembly load_image(const StoredJob& job, const TileGrid& grid) const;
  // True if a done job's image is gone, which can happen if a record in Redis outlives the disk with the
  // pixels.
  bool image_is_lost(const StoredJob& job) const;

 private:
  const std::filesystem::path data_;
  const bool shared_;
};

}  // namespace ls::coordinator
