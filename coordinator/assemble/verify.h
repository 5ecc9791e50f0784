// Verifies a worker's result: a partial, which is the encoded pixel sums of one unit. verify_result() keeps
// no state and needs no lock, so any thread may call it.
#pragma once

#include <variant>

#include "core/image/film/partial.h"
#include "util/protocol/messages.h"

namespace ls::coordinator {

// The partial is valid and of the right round, but has another sample range than the one needed now: the job
// was extended meanwhile.
struct OtherRange {
  SampleRange samples;
};
// The result is wrong: it is too large, its EXR file cannot be decoded, its header (tile, samples, scene,
// settings, numeric class), EXR windows or digest differ from the expected ones, its values are not finite,
// or its CPU time or health is impossible. The error names the fault.
struct BadResult {
  Error error;
};
using Verified = std::variant<Partial, OtherRange, BadResult>;

// Checks that `result` is a partial with the header `expected` of an image of size `frame` with these AOVs.
Verified verify_result(const UnitResult& result, const UnitHeader& expected, FrameSize frame,
                       AovSet aovs = {});

}  // namespace ls::coordinator
