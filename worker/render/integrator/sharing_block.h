// Chooses the pixels whose paths share their tails (path_reuse.h). The full frame is cut into squares
// (blocks). For each sample the pixels of a block are put in random order and then divided into groups, so
// that two pixels are rarely in the same group and their errors are nearly independent. Blocks begin at the
// corner of the full frame and do not depend on tiles, so a tile or crop has the same pixels as the whole
// image.
#pragma once

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <utility>

#include "common/scene/scene.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {

// If sharing of tails (path_reuse.h) is possible in this world, which is otherwise complete, and pays, sets
// its `reuse` and Features::reuse. Sharing is possible if the densities of second vertices are known. The
// settings request or forbid it, or leave the decision to a pilot (reuse_variants.cpp).
void share_tails(const IntegratorSettings& settings, int threads, World& w);

class SharingBlock {
 public:
  static constexpr int kSide = 16;  // pixels
  static_assert(kSide * kSide <= kMostTogether);

  // The block of a pixel of the image.
  SharingBlock(const World& w, PixelAt pixel) : w_(w) {
    row_ = (pixel.y + w.origin_y) / kSide;
    column_ = (pixel.x + w.origin_x) / kSide;
    width_ = std::min(kSide, w.frame.width - column_ * kSide);
    height_ = std::min(kSide, w.frame.height - row_ * kSide);
  }
  int row() const { return row_; }
  int column() const { return column_; }
  std::size_t pixels() const { return static_cast<std::size_t>(width_ * height_); }
  std::size_t index(PixelAt p) const {
    return static_cast<std::size_t>((p.y + w_.origin_y - row_ * kSide) * width_ + p.x + w_.origin_x -
                                    column_ * kSide);
  }
  using Pixels = boost::container::static_vector<PixelAt, kMostTogether>;
  // Returns the pixels of the block in a random order, which depends on the sample. Pixels may be outside the
  // image if it is a crop.
  Pixels in_order_of(std::uint64_t sample) const {
    Pixels order;
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        order.push_back({column_ * kSide + x - w_.origin_x, row_ * kSide + y - w_.origin_y});
    const auto corner = (static_cast<std::uint64_t>(row_) << 32) | static_cast<std::uint64_t>(column_);
    RandomStream dice(combine(combine(combine(w_.seed, kDealing), corner), sample));
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[dice.next() % i]);
    return order;
  }

 private:
  static constexpr std::uint64_t kDealing = 0x6465'616c;  // keys the random numbers

  const World& w_;
  int row_, column_, width_, height_;
};

}  // namespace ls::render
