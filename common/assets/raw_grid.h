// Raw `.bin` grids, little endian: int32 nx, ny, nz; float32 minimum x, y, z and maximum x, y, z of the box
// in the world; nx ny nz float32 values, x fastest or (called "x-major" by some converters) z fastest. The
// values are nodes: the outermost ones are on the faces of the box. No bytes may follow.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "common/assets/data.h"
#include "common/scene/scene.h"

namespace ls {

// Decodes a grid, which has one channel. A value that is NaN or infinite is an error that names its node;
// negative values become 0 and are counted. The result always has x fastest.
Result<GridData> decode_raw_grid(std::string_view name, std::span<const std::byte> file, GridOrder order);
Result<GridData> load_raw_grid(const std::filesystem::path& path, std::string_view name, GridOrder order);

}  // namespace ls
