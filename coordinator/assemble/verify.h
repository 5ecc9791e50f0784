// Is a worker's result what it claims to be? No state, no lock: runs on any thread.
#pragma once

#include <variant>

#include "common/image/partial.h"
#include "common/protocol/messages.h"

namespace ls::coordinator {

// An honest partial of the same round, but of another sample range than is wanted now: the job was extended
// meanwhile.
struct OtherRange {
  SampleRange samples;
};
// Not what it claims: wrong size, windows, scene, settings, class, tile, digest, or not finite. Says what.
struct BadResult {
  Error error;
};
using Verified = std::variant<Partial, OtherRange, BadResult>;

Verified verify_result(const UnitResult& result, const UnitHeader& expected, FrameSize frame,
                       AovSet aovs = {});

}  // namespace ls::coordinator
