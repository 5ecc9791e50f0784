// Makes the World of a scene, without the data that are learned by tracing paths through that World
// (integrator/light_paths.h).
#pragma once

#include <memory>

#include "worker/render/world/world.h"

namespace ls::render {

// The same as build_world() of render.h, but without learning.
Result<std::shared_ptr<World>> make_world(const Scene& scene, const RenderSettings& settings,
                                          const AssetFiles& files, int threads);

}  // namespace ls::render
