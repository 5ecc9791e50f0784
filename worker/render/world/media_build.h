// Converts the scene's media to the renderer's.
#pragma once

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Fills w.media, one per scene medium, and w.grids; counts corrected values in w.inputs. Media that neither
// the camera nor a surface refers to keep their index, but nothing is loaded for them. w.geometry gives the
// world's scale. invalid_argument names the file or medium and its fault.
Result<void> build_media(const Scene& scene, const AssetLoader& files, World& w);

}  // namespace ls::render
