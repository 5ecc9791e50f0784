// Admission: turns a submission into a job that can be rendered. The scene is read and checked, and all
// defaults are resolved.
#pragma once

#include <string>
#include <vector>

#include "common/image/reference/reference.h"
#include "coordinator/domain/farm/farm.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {

struct Admission {
  StoredJob job;               // the job to store, without id and time
  std::string scene_json;      // the scene in canonical form; its digest is job.scene
  std::size_t text_bytes = 0;  // bytes of all scene files that were read
};

// Reads the scene. The scene can use only the request's assets as files, so it can never read a path on this
// machine. Only assets that the scene uses become part of the job; each must be in `blobs`. Stores nothing.
// `frame` is the number of a frame of a sequence (a job with frames). The scene is then read for this frame,
// and the frame's seed is the job's seed plus this number. So frames have independent noise, and a frame that
// is rendered alone has the same pixels.
tl::expected<Admission, Rejected> admit(const SubmitRequest& request, const BlobStore& blobs,
                                        std::optional<std::uint32_t> frame = {});

// Admits all frames of spec.frames, or returns their errors. limits.h bounds the frames' total size.
tl::expected<std::vector<Admission>, Rejected> admit_sequence(const SubmitRequest& request,
                                                              const BlobStore& blobs);

// Returns a new job with the scene, settings and files of the job `before`, but without id, owner and time.
// If `changes` has any of spp, target_error and time, it replaces all three. The seed and priority of
// `changes` also apply; its other members are ignored. failed_precondition: a file of the scene is no longer
// in `blobs`.
Result<StoredJob> admit_again(const StoredJob& before, const JobSpec& changes, const BlobStore& blobs);

// Reads the job's reference image, for an image of this size. Errors: failed_precondition if its blob is
// missing, invalid_argument if it is not a suitable picture.
Result<Reference> load_reference(const JobSpec& spec, FrameSize size, const BlobStore& blobs);

// Returns the command that renders one of the job's samples again: common/job/health_notes.h.
std::string replay_of(const StoredJob& job);

// Returns the least memory, in bytes, that a worker needs for the job.
std::uint64_t memory_need(const StoredJob& job);

// Returns those settings of the stored job that the farm uses.
JobPlan plan_of(const StoredJob& job);

}  // namespace ls::coordinator
