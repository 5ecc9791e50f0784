#include "common/base/check.h"
#include "common/image/error/error_estimate.h"

namespace ls {

bool Checkpoints::ready(const Tile& tile) const {
  return tile.reached > complete() || (tile.stopped && tile.reached > 0);
}

void Checkpoints::change(TileIndex index, const std::function<void(Tile&)>& edit) {
  CHECK(index < tiles_.size(), "tile {} of {}", index, tiles_.size());
  Tile& tile = tiles_[index];
  const bool before = ready(tile);
  edit(tile);
  const bool after = ready(tile);
  if (before && !after) ++waiting_;
  if (!before && after) --waiting_;
  settle();
}

void Checkpoints::folded(TileIndex index, RoundIndex round, const TileError& error) {
  change(index, [&](Tile& tile) {
    if (round >= complete()) {
      // Replaces the figures of the tile from this round on. If the tile had stopped and skipped rounds,
      // these get the figures of its previous round.
      tile.pending.resize(round - complete(), tile.last);
      tile.pending.push_back(error);
    } else {
      tile.pending.clear();
    }
    tile.last = error;
    tile.reached = round + 1;
    tile.stopped = false;
  });
}

void Checkpoints::stopped(TileIndex index) {
  change(index, [](Tile& tile) { tile.stopped = true; });
}

void Checkpoints::settle() {
  while (waiting_ == 0) {
    TileError sum;
    bool moved = false;
    for (const Tile& tile : tiles_) {
      sum.add(tile.pending.empty() ? tile.last : tile.pending.front());
      moved |= !tile.pending.empty();
    }
    if (!moved) return;  // if every tile has stopped, there is no further checkpoint
    done_.push_back(sum);
    for (Tile& tile : tiles_) {
      if (!tile.pending.empty()) tile.pending.erase(tile.pending.begin());
      if (!ready(tile)) ++waiting_;
    }
  }
}

}  // namespace ls
