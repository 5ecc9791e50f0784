// Admission: turns a submission into a job that can be rendered. The scene is read and checked, and all
// defaults are resolved.
#pragma once

#include <string>
#include <vector>

#include "coordinator/domain/farm/farm.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/views/views.h"
#include "core/image/reference/reference.h"
#include "core/scene/reading.h"

namespace ls::coordinator {

struct Admission {
  StoredJob job;               // the job to store; it has no id and no time of submission yet
  std::string scene_json;      // the scene in canonical form; its digest is job.scene
  std::size_t text_bytes = 0;  // bytes of all scene files that were read
};

// Reads the submitted scene and makes a job of it. The scene can use only the request's assets as files, so
// it can never read a path on this machine. Only assets that the scene uses become part of the job; each must
// be in `blobs`. Stores nothing. `read` reads the scene. `frame` is the number of a frame of a sequence (a
// job with frames). The scene is then read for this frame, and the frame's seed is the job's seed plus this
// number. So frames have independent noise, and a frame that is rendered alone has the same pixels as in the
// sequence.
tl::expected<Admission, Rejected> admit(const SubmitRequest& request, const BlobStore& blobs,
                                        const SceneReader& read, std::optional<std::uint32_t> frame = {});

// Admits all frames of spec.frames, or returns their errors. The limits kMaxSequence... in
// coordinator/base/limits.h apply to all frames together.
tl::expected<std::vector<Admission>, Rejected> admit_sequence(const SubmitRequest& request,
                                                              const BlobStore& blobs,
                                                              const SceneReader& read);

// Returns a new job with the scene, settings and files of the job `before`, but without id, owner and time of
// submission. If `changes` has any of spp, target_error and time, all three are taken from `changes`. Its
// seed and memory (if set), priority, and denoise (if true) also apply, and its mix multiplies the light of
// the scene, which is then another scene (Admission::scene_json; empty if it is the scene of `before`). Its
// other members are ignored.
// `frame`: the number of the frame, if the new job is one of a new sequence, as `before` is one of the old
// sequence. failed_precondition: a file of the scene is no longer in `blobs`.
Result<Admission> admit_again(const StoredJob& before, const JobSpec& changes, const BlobStore& blobs,
                              std::optional<std::uint32_t> frame = {});

// Reads the reference image of a job whose image has this size. failed_precondition: its blob is missing.
// invalid_argument: it is too large, has another size, or cannot be read.
Result<Reference> load_reference(const JobSpec& spec, FrameSize size, const BlobStore& blobs);

// Returns the command that renders a sample of the job again, still without the pixel and the number of the
// sample (replay_command() in core/job/health_notes.h adds them).
std::string replay_of(const StoredJob& job);

// Returns the least memory, in bytes, that a worker needs for the job.
std::uint64_t memory_need(const StoredJob& job);

// Returns those settings of the stored job that the farm (coordinator/domain/farm/farm.h) needs to schedule
// it.
JobPlan plan_of(const StoredJob& job);

}  // namespace ls::coordinator
