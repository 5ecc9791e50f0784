// Groups of tiles that stop getting samples together (adaptive_stop.h). A decision to stop that rests on few
// pixels biases the image, so at least kMinStopPixels pixels decide together: small tiles form blocks, and
// the remainder at the right and bottom edges joins the neighbouring block. Only an image of fewer pixels
// forms one smaller group. The groups depend on the tiling alone.
#pragma once

#include <vector>

#include "common/image/frame/frame.h"

namespace ls::coordinator {

// Returns the tiles of each group, ascending; groups in the order of their first tiles. Every tile is in
// exactly one group.
std::vector<std::vector<TileIndex>> stop_groups(const TileGrid& grid);

}  // namespace ls::coordinator
