// Grids of voxels in two file formats, both little endian.
//
// Mitsuba's .vol, version 3: "VOL", a byte of value 3, int32 type, int32 nx ny nz, int32 channels, six
// float32 (minimum and maximum corner), then the values, x fastest. Types: 1 float32, 2 float16, 3 uint8 (0
// to 255 mean 0 to 1).
//
// Raw .bin: int32 nx, ny, nz; float32 minimum x, y, z and maximum x, y, z of the box in the world; nx ny nz
// float32 values. Either x or z varies fastest (some converters call the latter "x-major"). The values are at
// the nodes of a lattice whose outermost nodes are on the faces of the box. No bytes may follow.
//
// A value that is NaN or infinite is an error that names its voxel or node; negative values become 0 and are
// counted. In the result x varies fastest.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "core/assets/data.h"
#include "core/scene/scene.h"

namespace ls {

// Decodes or loads a .vol grid, which must have 1 or 3 channels.
Result<GridData> decode_vol(std::string_view name, std::span<const std::byte> file);
Result<GridData> load_vol(const std::filesystem::path& path, std::string_view name);

Result<GridData> decode_raw_grid(std::string_view name, std::span<const std::byte> file, GridOrder order);
Result<GridData> load_raw_grid(const std::filesystem::path& path, std::string_view name, GridOrder order);

}  // namespace ls
