// Pixel rectangles and the tiling of a frame.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>

namespace ls {

struct FrameSize {
  int width = 0;
  int height = 0;
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
// row by row from the top left.
struct TileGrid {
  FrameSize frame;
  int tile = 32;

  int columns() const { return (frame.width + tile - 1) / tile; }
  int rows() const { return (frame.height + tile - 1) / tile; }
  TileIndex count() const { return static_cast<TileIndex>(columns()) * static_cast<TileIndex>(rows()); }
  PixelRect rect(TileIndex i) const {
    const int x = static_cast<int>(i) % columns() * tile, y = static_cast<int>(i) / columns() * tile;
    return {x, y, std::min(x + tile, frame.width), std::min(y + tile, frame.height)};
  }
  bool operator==(const TileGrid&) const = default;
};

}  // namespace ls
