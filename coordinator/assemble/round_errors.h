// Keeps the error sums of every tile after every fold, as long as checkpoints need them. A round is a range
// of samples; folding adds a tile's next round to the image. A checkpoint gives a number of rounds for each
// tile, and sums the errors of the tiles after these rounds, even if some tiles already have later ones. So
// the errors of a checkpoint do not depend on the order in which results arrive.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/image/error/error_estimate.h"

namespace ls::coordinator {

// Drops the entries of one tile that no later checkpoint needs. `rounds` is ascending. A checkpoint with at
// least `next` rounds of the tile needs the latest entry before `next`, and later ones.
template <class T>
void drop_rounds_before(RoundIndex next, std::vector<std::pair<RoundIndex, T>>& rounds) {
  const auto later =
      std::find_if(rounds.begin(), rounds.end(), [&](const auto& r) { return r.first >= next; });
  if (later - rounds.begin() > 1) rounds.erase(rounds.begin(), later - 1);
}

class RoundErrors {
 public:
  // `keep_relative`: the relative error sums after all rounds are kept, even those that no checkpoint needs.
  // A job with a target error needs them after a restart, when its stop rule is fed again.
  RoundErrors(TileIndex tiles, bool keep_relative) : tiles_(tiles), keep_relative_(keep_relative) {}

  // Adds the tile's error after this round. The rounds of a tile come in order. If a truncated round comes
  // again in full, its new error replaces the old one.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // Returns the sum of all tiles' errors, in tile order, each after `rounds[tile]` rounds. A tile that has
  // fewer rounds counts with the error after its latest round. If the error that is needed has been dropped,
  // the next later one counts.
  TileError at(std::span<const RoundIndex> rounds) const;
  // True if at(rounds) is exact: all errors that it needs are still there.
  bool knows(std::span<const RoundIndex> rounds) const;
  // Called when the tile begins again without samples
  void discard(TileIndex tile) { tiles_[tile] = {}; }
  // Drops errors that no later checkpoint needs. Later calls of at() must request at least `rounds[tile]`
  // rounds of every tile.
  void checkpoint_taken(std::span<const RoundIndex> rounds);

  // Returns the relative error sums as [round][tile]; empty unless `keep_relative`. The sum is 0 for tiles
  // that have not reached a round.
  std::vector<std::vector<double>> relative() const;

  std::vector<std::byte> save_tile(TileIndex tile) const;
  Result<void> load_tile(TileIndex tile, std::span<const std::byte> bytes);
  bool operator==(const RoundErrors&) const = default;

 private:
  struct Tile {
    std::vector<std::pair<RoundIndex, TileError>> rounds;  // ascending
    std::vector<double> relative;                          // relative error sum after each round
    bool operator==(const Tile&) const = default;
  };
  std::vector<Tile> tiles_;
  bool keep_relative_ = false;
};

}  // namespace ls::coordinator
