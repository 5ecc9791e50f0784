// Shows a sequence (a job with frames) as one job, by combining the values of its frames. Pure functions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {

// Returns the state of the sequence. An open frame is one that has not ended. With open frames, the sequence
// is queued if no frame has begun, paused if all open frames are paused, and running otherwise. Without open
// frames, it is failed or cancelled if any frame is, else done.
JobState sequence_state(std::span<const JobView> frames);

struct SequenceFacts {
  JobId id;
  FrameRange range;
  std::vector<std::string> warnings;  // of all frames, without duplicates
  double elapsed_seconds = 0;
  double cores = 0;  // cores of the connected workers
  int workers = 0;   // number of connected workers
};
// `frames` has at least one frame; frames are in ascending order. The error is the mean over the pixels of
// the frames that have one; its interval treats the estimates as independent. The cost of the remaining
// frames is extrapolated from the work done so far. Their remaining time assumes as many cores as the
// sequence's limits allow and its units (rounds of tiles) can keep busy.
JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames);

FrameView frame_view(const JobView& frame);

}  // namespace ls::coordinator
