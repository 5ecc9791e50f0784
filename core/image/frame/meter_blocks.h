// The frame of a scene of meters: each meter has a block of kMeterSide x kMeterSide pixels. Every pixel of a
// block estimates the value of the meter, with numbers of its own, so that the pixels are independent and
// have the same distribution. The value of the meter is their mean.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/image/frame/frame.h"
#include "core/image/frame/render_limits.h"

namespace ls {

// Also the side of the squares for which the error of means is estimated (area_error.h). Blocks begin at
// multiples of it, as tiles do, so that no block is cut.
inline constexpr int kMeterSide = 16;
inline constexpr int kMeterPixels = kMeterSide * kMeterSide;

// Blocks are numbered row by row. There are as few columns as the height of a frame allows. The last blocks
// of the last row may be surplus: they measure the last meter once more, and are ignored.
class MeterBlocks {
 public:
  // `meters` is from 1 to kMaxMeters.
  explicit MeterBlocks(std::size_t meters) : meters_(static_cast<int>(meters)) {
    constexpr int kMostRows = kMaxFrameSide / kMeterSide;
    columns_ = (meters_ + kMostRows - 1) / kMostRows;
  }
  FrameSize frame() const {
    return {columns_ * kMeterSide, (meters_ + columns_ - 1) / columns_ * kMeterSide};
  }
  PixelRect rect(std::size_t meter) const {
    const int x = static_cast<int>(meter) % columns_ * kMeterSide,
              y = static_cast<int>(meter) / columns_ * kMeterSide;
    return {x, y, x + kMeterSide, y + kMeterSide};
  }
  // Returns the meter that the pixel measures.
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(std::min(y / kMeterSide * columns_ + x / kMeterSide, meters_ - 1));
  }

 private:
  int meters_, columns_;
};

}  // namespace ls
