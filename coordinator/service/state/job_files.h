// The folders of jobs in --data. DATA/jobs/ID contains the log of partials (the stored results of units) and
// the snapshot film.snap (the image so far), and for a done job image.exr, report.json and the thumbnails
// made so far. There are no folders if everything is in memory. A JobFiles object never changes, so several
// threads may use it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/snapshot.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

class JobFiles {
 public:
  // `data`: the data folder; empty if everything is in memory. `shared`: other coordinators use the same job
  // store.
  JobFiles(std::filesystem::path data, bool shared) : data_(std::move(data)), shared_(shared) {}

  bool on_disk() const { return !data_.empty(); }
  std::filesystem::path folder(const JobId& id) const { return data_ / "jobs" / id.value; }
  void remove_folder(const JobId& id) const;
  // Removes the folder of a job that was removed. It is renamed first, so that after a crash no half-removed
  // folder has the name of a job.
  void discard_folder(const JobId& id) const;
  void remove_discarded() const;  // removes folders that discard_folder() left when a crash interrupted it
  // If other coordinators share the store, removes the local folders of jobs that are not in `jobs`, because
  // others have taken them over. Folders with a final image are kept.
  void remove_unknown(const std::vector<StoredJob>& jobs) const;

  // Creates a new snapshot file of the job. Its name is film.snap with `suffix` until it is committed; then
  // it replaces film.snap.
  Result<SnapshotFile> create_snapshot(const StoredJob& job, const TileGrid& grid,
                                       std::string_view suffix) const;
  // Returns the image in the snapshot; an image without samples if there is no snapshot.
  Assembly load_image(const StoredJob& job, const TileGrid& grid) const;
  // Returns the tiles of the snapshot's image, to be read one by one; nullopt if there is no snapshot.
  std::optional<SnapshotTiles> tiles_of_image(const StoredJob& job, const TileGrid& grid) const;
  // Returns a name for the version of the job's image that the snapshot contains now. A later snapshot gives
  // another name.
  std::string image_version(const StoredJob& job) const;
  // Returns the file name for the thumbnail of the image in the snapshot. A later snapshot gives another
  // name.
  std::string thumbnail_name(const StoredJob& job) const;
  // True if the job is done but its image.exr does not exist. This can happen if the jobs' records are in
  // Redis and the disk with the image is lost.
  bool image_is_lost(const StoredJob& job) const;

 private:
  const std::filesystem::path data_;
  const bool shared_;
};

}  // namespace ls::coordinator
