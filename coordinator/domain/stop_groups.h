// Which tiles stop together. A decision to stop that rests on few pixels biases the image, so at least
// kMinStopPixels of them decide: small tiles are taken together in blocks, and what is left over at the right
// and bottom edge joins its neighbour. Only an image that has fewer pixels itself is one smaller group. A
// function of the tiling alone.
#pragma once

#include <vector>

#include "common/image/frame.h"

namespace ls::coordinator {

// The tiles of each group, ascending; groups in the order of their first tiles. Every tile is in exactly one.
std::vector<std::vector<TileIndex>> stop_groups(const TileGrid& grid);

}  // namespace ls::coordinator
