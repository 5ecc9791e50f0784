// From a submission to a job that can be rendered: the scene read and checked, everything that was left open
// resolved.
#pragma once

#include <string>
#include <vector>

#include "common/image/reference.h"
#include "coordinator/domain/farm.h"
#include "coordinator/service.h"
#include "coordinator/store/job_store.h"

namespace ls::coordinator {

struct Intake {
  StoredJob job;               // without id and time
  std::string scene_json;      // canonical; its digest is job.scene
  std::size_t text_bytes = 0;  // of all scene files that were read
};

// Reads the scene with the request's assets as its only files, so a scene can never reach a path of this
// machine. Only assets that the scene uses go into the job; each must be in `blobs`. Nothing is stored.
// `frame`: of a sequence. It is read with this number, and its seed is the job's plus this number: frames
// have noise of their own, and each is rendered alone to the same pixels.
tl::expected<Intake, Rejected> take_in(const SubmitRequest& request, const BlobStore& blobs,
                                       std::optional<std::uint32_t> frame = {});

// All frames of spec.frames, or what is wrong with them: limits.h bounds what they take together.
tl::expected<std::vector<Intake>, Rejected> take_in_sequence(const SubmitRequest& request,
                                                             const BlobStore& blobs);

// What renders one of its samples again: common/job/replay_command.h.
// The reference that a job of this size asks for. failed_precondition: its blob is not here;
// invalid_argument: it is not such a picture.
Result<Reference> load_reference(const JobSpec& spec, FrameSize size, const BlobStore& blobs);

std::string replay_of(const StoredJob& job);

// Bytes of memory that a worker must have for it, at least.
std::uint64_t memory_need(const StoredJob& job);

// The farm's view of a stored job.
JobPlan plan_of(const StoredJob& job);

}  // namespace ls::coordinator
