// Verifies a worker's result. It has no state and no lock, and runs on any thread. A partial is the encoded
// pixel sums of one unit, that is, of one round (range of samples) of one tile.
#pragma once

#include <variant>

#include "common/image/film/partial.h"
#include "common/protocol/messages.h"

namespace ls::coordinator {

// The partial is valid and of the right round, but its sample range is no longer the one that is needed: the
// job was extended meanwhile.
struct OtherRange {
  SampleRange samples;
};
// The result is wrong: its size, windows, scene, settings, numeric class, tile or digest differ from the
// expected ones, or it has values that are not finite. The error names the difference.
struct BadResult {
  Error error;
};
using Verified = std::variant<Partial, OtherRange, BadResult>;

// Checks that `result` is a partial with the header `expected` of an image of size `frame` with these AOVs.
Verified verify_result(const UnitResult& result, const UnitHeader& expected, FrameSize frame,
                       AovSet aovs = {});

}  // namespace ls::coordinator
