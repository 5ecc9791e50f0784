// Writes the files of a job, on the writer thread: the list of open audits (units that are rendered again for
// comparison), snapshots (the image so far, for a restart) from time to time, and at the end the final image
// and the report.
#pragma once

#include "coordinator/assemble/job_report.h"
#include "coordinator/domain/event.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/reference_comparer.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/records.h"
#include "coordinator/store/blobs/blob_store.h"
#include "core/base/guarded.h"
#include "core/image/exr/final_image.h"

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
  // For a job whose target is the error of the denoised image: starts to denoise the job's film (its image in
  // memory) as it is now, at `spp` samples per pixel. Afterwards the error of the denoised image is stored
  // and reported to the farm. If denoising fails, the job is paused, with the reason in JobEntry::trouble.
  void check_denoised(Core&, const EntryPtr& entry, double spp);
  // Starts to write the final image of a job that the farm has finished. The job becomes `done` when the
  // image is written.
  void finish(Core&, const EntryPtr& entry);
  void finish_again(Core&, const EntryPtr& entry);  // repeats finish() after it failed
  // Starts writing the current image of a failed or cancelled job, and frees the job's memory afterwards.
  void retire(Core&, const EntryPtr& entry);
  // Repeats finish() and retire() for jobs whose files could not be written, limits::kWriteAgain after the
  // last attempt
  void write_again_if_due(Core&);

 private:
  struct Folded {  // a cheap copy of the job's image so far, for use outside the lock
    Film film;
    RoundErrors errors;
    HealthTable health;
  };
  // A job whose files at its end could not be written
  struct Unwritten {
    EntryPtr entry;
    std::uint64_t final_number;  // number of the request for the final image; 0: the job was retired
    TimePoint again;             // when they are written again
  };
  // The following functions run on the writer thread, except denoise() and note_check(), which run on the
  // thread of the ReferenceComparer.
  void take_snapshot(const EntryPtr& entry);
  Result<SnapshotFile> copy_folded(const EntryPtr& entry);
  Result<void> write_snapshot(const EntryPtr& entry, const Folded& folded);
  void denoise(const EntryPtr& entry, std::uint64_t number);
  void note_check(const EntryPtr& entry, std::uint64_t curve, double spp, const Denoised& made);
  void write_final(const EntryPtr& entry, std::uint64_t number);
  // `denoised` becomes the denoised image, if it is null and the job wants one.
  Result<void> write_files(const EntryPtr& entry, const Folded& folded, ReportFacts& facts,
                           std::shared_ptr<const Denoised>& denoised);
  void write_retired(const EntryPtr& entry);

  Guarded<Core>& core_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  Denoising& denoising_;
  ReferenceComparer& comparer_;
  BackgroundWrites& writes_;
  const Clock& clock_;
  std::uint64_t last_final_ = 0;      // number of the latest request for a final image; guarded by the lock
  std::vector<Unwritten> unwritten_;  // guarded by the lock
};

// Returns the attributes for the header of a final image, which describe the job. If the image has
// cryptomattes (layers that identify shapes or materials), the scene is read for the names of shapes and
// materials.
Provenance provenance_of(const ReportFacts& facts, const BlobStore& blobs);
// Returns the names in the job's image: those of its light groups, and those of the shapes and materials that
// the identifiers in its cryptomattes stand for. Reads the scene if the job has cryptomattes; if the scene
// cannot be read, they get no names.
LayerNames layer_names_of(const StoredJob& job, const BlobStore& blobs);

}  // namespace ls::coordinator
