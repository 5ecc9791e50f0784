// Shows a sequence (a job with frames) as one job, by combining the values of its frames. Pure functions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "coordinator/views/views.h"

namespace ls::coordinator {

// Returns the state of the sequence. While frames are open (have not ended), it is paused if all of them are
// paused, else queued if no frame has begun, else running. Then it is failed if any frame failed, else
// cancelled if any was cancelled, else done.
JobState sequence_state(std::span<const JobView> frames);

struct SequenceFacts {
  JobId id;
  FrameRange range;
  std::vector<std::string> warnings;  // of all frames, without duplicates
  double elapsed_seconds = 0;
  double cores = 0;  // cores of the connected workers
  int workers = 0;   // number of connected workers
};
// Requires at least one frame; frames are ascending. The error is the mean over the pixels of the frames that
// have one, and its interval treats these estimates as independent. The cost of the remaining frames is
// extrapolated from the work so far. The remaining time assumes as many cores as the sequence's limits allow
// and its units (rounds of tiles) can keep busy.
JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames);

FrameView frame_view(const JobView& frame);

}  // namespace ls::coordinator
