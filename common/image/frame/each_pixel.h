// Visits the pixels of a tile with their indices in the frame and in the tile.
#pragma once

#include <cstddef>

#include "common/image/frame/frame.h"

namespace ls {

// Calls put(to, from) for each pixel of the tile, row by row. `to` is its index in the frame, `from` its
// index in the tile.
template <class Put>
void each_pixel(const PixelRect& rect, FrameSize frame, Put put) {
  std::size_t from = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++from)
      put(static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(x),
          from);
}

}  // namespace ls
