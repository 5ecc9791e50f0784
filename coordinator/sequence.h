// A sequence shown as one job: the figures of its frames taken together. Pure.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "coordinator/service.h"

namespace ls::coordinator {

// While any frame goes on: running, unless nothing has begun (queued) or all that is left is paused. After
// that: failed or cancelled if any frame is, else done.
JobState sequence_state(std::span<const JobView> frames);

struct SequenceFacts {
  JobId id;
  FrameRange range;
  std::vector<std::string> warnings;  // of all frames, each once
  double elapsed_seconds = 0;
  double cores = 0;  // of the connected workers
  int workers = 0;   // connected
};
// `frames`: at least one, ascending. Error figures are the mean over the pixels of those frames that have
// some, their interval that of independent estimates. What the frames left will cost is taken from what was
// done of the others; their time left is that on as many cores as its limits and its units keep busy.
JobView sequence_view(const SequenceFacts& facts, std::span<const JobView> frames);

FrameView frame_view(const JobView& frame);

}  // namespace ls::coordinator
