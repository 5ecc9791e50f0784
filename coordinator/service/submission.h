// Accepts a user's submission: a job, or a sequence, which is one job per frame.
#pragma once

#include "coordinator/base/gate.h"
#include "coordinator/base/limits.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/store/blobs/collected_blobs.h"
#include "coordinator/views/views.h"
#include "core/base/guarded.h"
#include "core/scene/reading.h"

namespace ls::coordinator {

struct Core;

class Submission {
 public:
  Submission(Guarded<Core>& core, JobStore& store, const JobFiles& files, CollectedBlobs& blobs,
             const OpenReader& scenes, const Denoising& denoising, const Clock& clock,
             std::uint64_t film_bytes)
      : core_(core),
        store_(store),
        files_(files),
        blobs_(blobs),
        scenes_(scenes),
        denoising_(denoising),
        clock_(clock),
        film_bytes_(film_bytes) {}

  // Returns the id of the job or sequence. Users take turns: the scenes of one user are read one after
  // another, and those of all within kAdmissionBytes of memory. All frames of a sequence are stored, or none.
  tl::expected<JobId, Rejected> submit(const SubmitRequest& request);

  // Submits the scene of job `before`, which must not be a sequence, once more. Returns the id of the new
  // job. `traceparent`: as in SubmitRequest.
  Result<JobId> submit_again(const JobId& before, const JobSpec& changes, const std::string& owner,
                             const std::string& traceparent = {});

 private:
  // `began`: when the scene's admission began
  Result<JobId> take(std::vector<StoredJob> jobs, const std::optional<FrameRange>& range, TimePoint began);

  Guarded<Core>& core_;
  JobStore& store_;
  const JobFiles& files_;
  CollectedBlobs& blobs_;
  const OpenReader& scenes_;
  const Denoising& denoising_;
  const Clock& clock_;
  const std::uint64_t film_bytes_;  // as Coordinator::Options::film_bytes
  Gate turns_{{.places = limits::kAdmissions,
               .places_each = 1,
               .bytes = limits::kAdmissionBytes,
               .bytes_each = limits::kAdmissionBytes / 2}};
};

}  // namespace ls::coordinator
