// From a scene's media to those of the renderer.
#pragma once

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/asset_loader.h"
#include "worker/render/world.h"

namespace ls::render {

// Fills w.media, one for each of the scene's, and w.grids; counts in w.inputs. Media that neither the
// camera nor a surface names keep their place in the list, but nothing of them is loaded. w.geometry gives
// the world's scale. invalid_argument says what is wrong with which file or medium.
Result<void> build_media(const Scene& scene, const AssetLoader& files, World& w);

}  // namespace ls::render
