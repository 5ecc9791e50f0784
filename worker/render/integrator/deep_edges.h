// Where the slices of a pixel of a deep image begin and end (core/image/aov/deep_planes.h).
#pragma once

#include "worker/render/world/world.h"

namespace ls::render {

// Returns the edges of the pixel (x, y) of the full frame, for the slices of world.aovs. They are a function
// of the scene, the settings and the pixel.
DeepEdges deep_edges(const World& world, int x, int y);

}  // namespace ls::render
