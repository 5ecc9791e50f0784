// Renders some camera paths before the first sample, to learn which techniques pay for a scene.
#pragma once

#include <optional>

#include "worker/render/world/world.h"

namespace ls::render {

// The mean radiance, over the channels, of camera paths at random places of the full frame that end after at
// most `max_depth` segments. Always the same for a scene and a size of the frame: the seed, the number of
// samples and a crop have no part in it. nullopt for frames that are not worth the paths. The world is
// otherwise complete, and is the same afterwards.
std::optional<double> pilot_radiance(World& w, int max_depth);

}  // namespace ls::render
