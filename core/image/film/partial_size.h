// The size of the file of a unit's result (core/image/film/partial.h).
#pragma once

#include <cstdint>

#include "core/image/aov/aov.h"

namespace ls {

// Returns the largest number of bytes of the EXR file of a partial with this number of pixels: its planes,
// for each channel an entry in the channel list (a name of at most 31 bytes, its end, and 16 bytes), and 16
// KiB for the other attributes and the line offsets.
inline std::uint64_t most_partial_file_bytes(std::uint64_t pixels, AovSet aovs) {
  constexpr std::uint64_t kChannel = 48, kOthers = 16 << 10;
  const std::uint64_t per_pixel = partial_bytes_per_pixel(aovs);
  return pixels * per_pixel + per_pixel / sizeof(float) * kChannel + kOthers;
}

}  // namespace ls
