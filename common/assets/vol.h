// Mitsuba's .vol grids, version 3: "VOL", byte 3, int32 type, int32 nx ny nz, int32 channels, six float32
// (minimum and maximum corner), then the values; little endian, x fastest. Types: 1 float32, 2 float16, 3
// uint8 (0..255 for 0..1).
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "common/assets/data.h"

namespace ls {

// Decode a grid of 1 or 3 channels. A value that is NaN or infinite is an error that names its voxel;
// negative values become 0 and are counted.
Result<GridData> decode_vol(std::string_view name, std::span<const std::byte> file);
Result<GridData> load_vol(const std::filesystem::path& path, std::string_view name);

}  // namespace ls
