// Takes a user's submission: a job, or a sequence of jobs, one for each frame.
#pragma once

#include "coordinator/base/guarded.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/store/blobs/collected_blobs.h"
#include "coordinator/views/submit_request.h"

namespace ls::coordinator {

struct Core;

class Submission {
 public:
  Submission(Guarded<Core>& core, JobStore& store, const JobFiles& files, CollectedBlobs& blobs,
             const Denoising& denoising, const Clock& clock)
      : core_(core), store_(store), files_(files), blobs_(blobs), denoising_(denoising), clock_(clock) {}

  // Returns the id of the job or sequence. All frames of a sequence are stored, or none.
  tl::expected<JobId, Rejected> submit(const SubmitRequest& request);

 private:
  Guarded<Core>& core_;
  JobStore& store_;
  const JobFiles& files_;
  CollectedBlobs& blobs_;
  const Denoising& denoising_;
  const Clock& clock_;
};

}  // namespace ls::coordinator
