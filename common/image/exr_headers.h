// A look at an EXR's headers before the library sees them: it allocates what they claim (tables, buffers,
// strings), and a file of a few hundred bytes can claim terabytes.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/base/error.h"
#include "common/image/exr_file.h"

namespace ls::exr {

// Every part's size within `limits`, every attribute inside the file and as long as its type says, every
// chunk table no longer than the file, and the buffer of one chunk at most kMaxChunkBytes. Whether the file
// makes sense otherwise is left to the library.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30;
inline constexpr int kMaxParts = 256;
Result<void> check_headers(std::span<const std::byte> file, const std::string& name, const ExrLimits& limits);

}  // namespace ls::exr
