// Where the slices of a pixel of a deep image begin and end (core/image/aov/deep_planes.h).
#pragma once

#include <vector>

#include "worker/render/world/world.h"

namespace ls::render {

// Returns the edges of the pixel (x, y) of the full frame: one more than the slices of world.aovs, ascending
// by magnitude, as depths in the world's units; an edge is negative if its slice has surfaces only. The edges
// are a function of the scene, the settings and the pixel.
std::vector<float> deep_edges(const World& world, int x, int y);

}  // namespace ls::render
