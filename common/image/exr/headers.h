// Checks an EXR's headers before the library reads the file. The library allocates tables, buffers and
// strings of the sizes that the headers claim, and a file of a few hundred bytes can claim terabytes.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/base/error.h"
#include "common/image/exr/exr_file.h"

namespace ls::exr {

// Checks that every part's size is within `limits`, that every attribute lies inside the file and is as long
// as its type requires, that every chunk table fits into the file, and that the buffer of one chunk has at
// most kMaxChunkBytes. The library checks everything else.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30;
inline constexpr int kMaxParts = 256;
Result<void> check_headers(std::span<const std::byte> file, const std::string& name, const ExrLimits& limits);

}  // namespace ls::exr
