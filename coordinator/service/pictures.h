// Reads what a job has rendered: images, maps, tiles, the report, the log. Images of jobs under way are
// copied under the lock; those of jobs that have ended are read from disk.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "coordinator/base/guarded.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/state/job_entry.h"
#include "coordinator/service/state/job_files.h"

namespace ls::coordinator {

struct Core;

class Pictures {
 public:
  Pictures(Guarded<Core>& core, const JobStore& store, const JobFiles& files, const BlobStore& blobs,
           Denoising& denoising, const Clock& clock)
      : core_(core), store_(store), files_(files), blobs_(blobs), denoising_(denoising), clock_(clock) {}

  Result<std::vector<std::byte>> image_exr(const JobId& id) const;
  Result<std::vector<std::byte>> image_png(const JobId& id, double exposure, bool denoised) const;
  Result<std::vector<std::byte>> error_png(const JobId& id) const;
  Result<std::vector<std::byte>> samples_png(const JobId& id) const;
  Result<std::vector<TileView>> tiles(const JobId& id) const;
  // The report of a sequence has the values of each frame and those of all frames together.
  Result<std::string> report_json(const JobId& id) const;
  // The log of a sequence has the lines of all frames, ordered by time.
  Result<std::string> log(const JobId& id) const;
  // Returns the path of the file `name` of a done job; empty if there is none.
  std::filesystem::path final_file(const JobId& id, const std::string& name) const;

 private:
  struct Picture {
    Film film;
    ReportFacts facts;
  };
  Result<Picture> picture(const JobId& id) const;
  std::string sequence_report(const JobView& view) const;

  Guarded<Core>& core_;
  const JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  Denoising& denoising_;
  const Clock& clock_;
};

}  // namespace ls::coordinator
