// A sequence shown as one job: combines the values of its frames. Pure functions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {

// While any frame is open: running, unless no frame has begun (queued) or all open frames are paused.
// Otherwise failed or cancelled if any frame is, else done.
JobState sequence_state(std::span<const JobView> frames);

struct SequenceFacts {
  JobId id;
  FrameRange range;
  std::vector<std::string> warnings;  // of all frames, without duplicates
  double elapsed_seconds = 0;
  double cores = 0;  // of the connected workers
  int workers = 0;   // connected
};
// `frames`: at least one, ascending. The error is the mean over the pixels of the frames that have one, with
// an interval as for independent estimates. The cost of the remaining frames is extrapolated from the work
// done so far; their remaining time assumes as many cores as the sequence's limits and units can keep busy.
JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames);

FrameView frame_view(const JobView& frame);

}  // namespace ls::coordinator
