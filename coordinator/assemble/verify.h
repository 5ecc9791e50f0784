// Verification of a worker's result. No state, no lock: runs on any thread.
#pragma once

#include <variant>

#include "common/image/film/partial.h"
#include "common/protocol/messages.h"

namespace ls::coordinator {

// An honest partial of the right round, but of another sample range than needed now: the job was extended
// meanwhile.
struct OtherRange {
  SampleRange samples;
};
// Wrong size, windows, scene, settings, class, tile or digest, or not finite; the error says which.
struct BadResult {
  Error error;
};
using Verified = std::variant<Partial, OtherRange, BadResult>;

Verified verify_result(const UnitResult& result, const UnitHeader& expected, FrameSize frame,
                       AovSet aovs = {});

}  // namespace ls::coordinator
