// Loads a scene's volume as grids in the world.
#pragma once

#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/media/grid.h"

namespace ls::render {

struct LoadedVolume {
  std::vector<Grid> channels;  // 1 or 3
  std::uint64_t clamped = 0;   // negative values set to 0
};

// Grids of the volume's channels. `center`, `scale`: scene to world. `to_sigma`: largest extinction per unit
// of value, in world units. invalid_argument names the file and its fault.
Result<LoadedVolume> load_volume(const Volume& volume, const AssetLoader& files, V3d center, double scale,
                                 double to_sigma);

}  // namespace ls::render
