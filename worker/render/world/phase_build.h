// Makes the phase functions of a world.
#pragma once

#include "core/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/media/medium.h"

namespace ls::render {

class World;

// Makes World::phases. Fails with invalid_argument if a mean cosine is too close to 1 or -1, or if the grid
// of a blend is not from 0 to 1.
Result<void> build_phases(const Scene& scene, const AssetLoader& files, World& w);

// Gives the medium phase function number i of the scene. `all` are the world's.
void set_phase(const Scene& scene, PhaseIndex i, const PhaseFunctions& all, Medium& m);

}  // namespace ls::render
