// Makes fields (field.h) and height fog of the scene's volumes.
#pragma once

#include <memory>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/media/field.h"

namespace ls::render {

// Returns the profile of a height fog in world coordinates; `center` and `scale` are as of load_volume().
// Fails with invalid_argument if its transform or its size leaves the range of numbers.
Result<HeightProfile> height_profile(const HeightFogVolume& fog, V3d center, double scale);

// A field, and the grid that bounds it, with the field in place of values.
struct BuiltField {
  std::unique_ptr<const Field> field;  // the grid points to it
  Grid grid;
  std::uint64_t clamped = 0;  // number of negative values of stored grids that were set to 0
};

// Builds the field of a volume that has a box (scene::has_box). The other parameters, and errors, are as of
// load_volume().
Result<BuiltField> build_field(const Volume& volume, const AssetLoader& files, V3d center, double scale);

}  // namespace ls::render
