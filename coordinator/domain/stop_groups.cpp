#include "coordinator/domain/stop_groups.h"

#include <algorithm>
#include <cstdint>

#include "coordinator/domain/limits.h"

namespace ls::coordinator {
namespace {

std::int64_t divided_up(std::int64_t a, std::int64_t b) { return (a + b - 1) / b; }

// One side of the frame: how many tiles it has, and how they form blocks of `block` tiles. `whole` is the
// number of tiles that are not cut by the frame's edge, at least 1. Only these form blocks; what is left over
// joins the last block.
struct Side {
  int tiles, whole, block;
  int blocks() const { return std::max(1, whole / block); }
  int block_of(int tile) const { return std::min(tile / block, blocks() - 1); }
};

// Divides a side of `frame` pixels into blocks of as many tiles (of `tile` pixels) as it takes for a block to
// have kMinStopPixels pixels. `across` is the block's extent in the other direction, in pixels.
Side side_of(int frame, int tile, int across) {
  const int whole = std::max(1, frame / tile);
  const auto wanted = divided_up(kMinStopPixels, std::int64_t{across} * std::min(tile, frame));
  return {(frame + tile - 1) / tile, whole, static_cast<int>(std::min<std::int64_t>(wanted, whole))};
}

}  // namespace

std::vector<std::vector<TileIndex>> stop_groups(const TileGrid& grid) {
  const int width = grid.frame.width, height = grid.frame.height;
  int square = grid.tile;
  while (std::int64_t{square} * square < kMinStopPixels) square += grid.tile;
  // If the frame is lower than a square block, blocks are wider, and the other way round.
  const Side x = side_of(width, grid.tile, std::min(square, height));
  const Side y = side_of(height, grid.tile, std::min(width, x.block * grid.tile));
  std::vector<std::vector<TileIndex>> groups(static_cast<std::size_t>(x.blocks()) *
                                             static_cast<std::size_t>(y.blocks()));
  for (TileIndex t = 0; t < grid.count(); ++t) {
    const int column = static_cast<int>(t) % x.tiles, row = static_cast<int>(t) / x.tiles;
    const auto group = static_cast<std::size_t>(y.block_of(row)) * static_cast<std::size_t>(x.blocks()) +
                       static_cast<std::size_t>(x.block_of(column));
    groups[group].push_back(t);
  }
  return groups;
}

}  // namespace ls::coordinator
