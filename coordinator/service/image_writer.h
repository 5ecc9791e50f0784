// Writes the files of a job that renders, on the writer thread: open audits, now and then a snapshot, and at
// the end the final image and the report.
#pragma once

#include "coordinator/base/guarded.h"
#include "coordinator/domain/event.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/reference_comparer.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/records.h"

namespace ls::coordinator {

class ImageWriter {
 public:
  ImageWriter(Guarded<Core>& core, const JobFiles& files, const BlobStore& blobs, Denoising& denoising,
              ReferenceComparer& comparer, BackgroundWrites& writes, const Clock& clock)
      : core_(core),
        files_(files),
        blobs_(blobs),
        denoising_(denoising),
        comparer_(comparer),
        writes_(writes),
        clock_(clock) {}

  void keep_audits(Core&, const EntryPtr& entry, const std::vector<JobRestored::Audit>& audits);
  void snapshot_if_due(Core&, const EntryPtr& entry);
  // Has the final image of a job written that the farm has finished. The job is done when that has succeeded.
  void finish(Core&, const EntryPtr& entry);
  void finish_again(Core&, const EntryPtr& entry);  // after it could not be written
  // Has the image of a failed or cancelled job written, as it is, and its memory freed.
  void retire(Core&, const EntryPtr& entry);

 private:
  struct Folded {  // a copy of the folded image, cheap to make, to use outside the lock
    Film film;
    RoundErrors errors;
    HealthTable health;
  };
  // All of these run on the writer thread, denoise() on the comparing thread
  void take_snapshot(const EntryPtr& entry);
  Result<SnapshotFile> copy_folded(const EntryPtr& entry);
  Result<void> write_snapshot(const EntryPtr& entry, const Folded& folded);
  void denoise(const EntryPtr& entry, std::uint64_t number);
  void write_final(const EntryPtr& entry, std::uint64_t number);
  Result<void> write_files(const EntryPtr& entry, const Folded& folded, ReportFacts& facts,
                           std::shared_ptr<const Denoised> denoised);
  void write_retired(const EntryPtr& entry);

  Guarded<Core>& core_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  Denoising& denoising_;
  ReferenceComparer& comparer_;
  BackgroundWrites& writes_;
  const Clock& clock_;
  std::uint64_t last_final_ = 0;  // number of the last final image that was asked for; guarded by the lock
};

}  // namespace ls::coordinator
