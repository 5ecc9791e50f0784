// Makes the World of a scene, except for the data that are learned later by tracing paths through that World
// (integrator/light_paths.h).
#pragma once

#include <memory>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Does what build_world() of render.h does, but leaves out the learning.
Result<std::shared_ptr<World>> make_world(const Scene& scene, const RenderSettings& settings,
                                          const AssetFiles& files, int threads);

// Converts the scene's media: fills w.media, with one medium per medium of the scene, and w.grids, and counts
// corrected values in w.inputs. Media that neither the camera nor a surface refers to keep their index, but
// nothing is loaded for them. w.geometry must be built already, since it gives the world's scale. Fails with
// invalid_argument; the message names the file or medium and its fault.
Result<void> build_media(const Scene& scene, const AssetLoader& files, World& w);

}  // namespace ls::render
