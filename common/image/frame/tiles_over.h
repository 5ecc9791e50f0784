// Tiles of a frame that a rectangle of pixels overlaps.
#pragma once

#include <vector>

#include "common/image/frame/frame.h"

namespace ls {

// True if the rectangle is not empty and lies inside the frame.
inline bool lies_in(FrameSize frame, const PixelRect& rect) {
  return 0 <= rect.x0 && rect.x0 < rect.x1 && rect.x1 <= frame.width && 0 <= rect.y0 && rect.y0 < rect.y1 &&
         rect.y1 <= frame.height;
}

// Returns the tiles that have pixels in `rect`, row by row. The rectangle must lie in the frame.
inline std::vector<TileIndex> tiles_over(const TileGrid& grid, const PixelRect& rect) {
  std::vector<TileIndex> out;
  for (int row = rect.y0 / grid.tile; row * grid.tile < rect.y1; ++row)
    for (int column = rect.x0 / grid.tile; column * grid.tile < rect.x1; ++column)
      out.push_back(static_cast<TileIndex>(row) * static_cast<TileIndex>(grid.columns()) +
                    static_cast<TileIndex>(column));
  return out;
}

}  // namespace ls
