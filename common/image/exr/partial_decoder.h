// Shared by the encoder and the decoder of partials (files with the pixel sums of one tile and range of
// samples).
#pragma once

#include <array>
#include <cstdint>

#include "common/image/film/partial.h"

namespace ls {

inline constexpr char kUnitAttribute[] = "lightshaft:unit";
// The names of the colour channels in the order of the planes in memory. A file has its channels sorted by
// name: kFileOrder[i] is the plane of the file's i-th channel. The AOV channels follow in both, in their own
// order.
inline constexpr std::array<const char*, kPartialChannels> kPartialChannelNames = {"A.R", "A.G", "A.B",
                                                                                   "B.R", "B.G", "B.B"};
inline constexpr std::array<int, kPartialChannels> kFileOrder = {2, 1, 0, 5, 4, 3};
inline constexpr std::int64_t kMaxPartialPixels = 256 * 256;  // the largest tile

// The error names the first pixel, channel and value that is not finite.
Result<void> all_finite(const Partial& partial);
// The error names the first pixel and AOV with impossible counts or identifiers.
Result<void> counts_possible(const Partial& partial);

}  // namespace ls
