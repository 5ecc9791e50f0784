// Pixel rectangles, and the tiling of a frame.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ls {

struct FrameSize {
  int width = 0;
  int height = 0;
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  bool operator==(const FrameSize&) const = default;
};

// A half-open pixel rectangle [x0, x1) x [y0, y1); y grows downwards, (0, 0) is the top left pixel.
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  std::int64_t pixels() const { return static_cast<std::int64_t>(width()) * height(); }
  bool operator==(const PixelRect&) const = default;
};
// Returns "[x0,y0,x1,y1]", for messages.
inline std::string show(const PixelRect& r) { return fmt::format("[{},{},{},{}]", r.x0, r.y0, r.x1, r.y1); }

using TileIndex = std::uint32_t;

// The tiling of a frame: tiles of `tile` x `tile` pixels (smaller at the right and bottom edges), numbered
// row by row from the top left. `meters`: each block of pixels measures one number (meter_blocks.h).
struct TileGrid {
  FrameSize frame;
  int tile = 32;
  bool meters = false;

  int columns() const { return (frame.width + tile - 1) / tile; }
  int rows() const { return (frame.height + tile - 1) / tile; }
  TileIndex count() const { return static_cast<TileIndex>(columns()) * static_cast<TileIndex>(rows()); }
  PixelRect rect(TileIndex i) const {
    const int x = static_cast<int>(i) % columns() * tile, y = static_cast<int>(i) / columns() * tile;
    return {x, y, std::min(x + tile, frame.width), std::min(y + tile, frame.height)};
  }
  bool operator==(const TileGrid&) const = default;
};

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

// Calls put(to, from) for each pixel of the tile, row by row. `to` is the index of the pixel in the frame,
// `from` its index in the tile `rect`; both count pixels row by row.
template <class Put>
void each_pixel(const PixelRect& rect, FrameSize frame, Put put) {
  std::size_t from = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++from)
      put(static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(x),
          from);
}

}  // namespace ls
