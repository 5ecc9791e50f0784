// Loads one volume of the scene as grids in world space.
#pragma once

#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/media/field.h"
#include "worker/render/media/grid.h"

namespace ls::render {

struct LoadedVolume {
  std::vector<Grid> channels;          // one grid per channel; 1 or 3 channels
  std::uint64_t clamped = 0;           // number of negative values that were set to 0
  std::unique_ptr<const Field> field;  // set if the one grid looks its values up in it
};

// Loads the grids of the volume's channels. `center` and `scale` map scene to world coordinates: p' = (p -
// center) * scale. `to_sigma` is the largest extinction per unit of value, in world units. Fails with
// invalid_argument if the file is at fault; the message names the file and the fault.
Result<LoadedVolume> load_volume(const Volume& volume, const AssetLoader& files, V3d center, double scale,
                                 double to_sigma);

}  // namespace ls::render
