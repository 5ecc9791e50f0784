// The error sums of every tile after every fold, as long as they are needed. A checkpoint gives the number of
// rounds of each tile that count and sums the errors after these, even if some tiles are ahead already. So
// the errors of a checkpoint do not depend on the order of arrival.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/image/error/error_estimate.h"

namespace ls::coordinator {

class RoundErrors {
 public:
  // `keep_relative`: also keep each fold's relative error sum for good; the farm's stop rule needs them after
  // a restart.
  RoundErrors(TileIndex tiles, bool keep_relative) : tiles_(tiles), keep_relative_(keep_relative) {}

  // Rounds of a tile come in order; a round given again (a truncated one, now in full) replaces the earlier
  // error.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // The sum after `rounds` of each tile, in tile order. A tile with fewer rounds counts with what it has; a
  // tile of which only later rounds are kept, because it was ahead at an earlier checkpoint, with the first
  // of those.
  TileError at(std::span<const RoundIndex> rounds) const;
  // True if at(rounds) is exact: nothing that it needs has been dropped.
  bool knows(std::span<const RoundIndex> rounds) const;
  void discard(TileIndex tile) { tiles_[tile] = {}; }  // the tile is folded again from round 0
  // at() will not be called with fewer rounds again
  void checkpoint_taken(std::span<const RoundIndex> rounds);

  // [round][tile]; empty unless kept. 0 for tiles that have not reached a round.
  std::vector<std::vector<double>> relative() const;

  std::vector<std::byte> save() const;
  std::vector<std::byte> save_tile(TileIndex tile) const;
  Result<void> load_tile(TileIndex tile, std::span<const std::byte> bytes);
  static Result<RoundErrors> load(std::span<const std::byte> bytes, TileIndex tiles, bool keep_relative);
  bool operator==(const RoundErrors&) const = default;

 private:
  struct Tile {
    std::vector<std::pair<RoundIndex, TileError>> rounds;  // ascending
    std::vector<double> relative;                          // by round
    bool operator==(const Tile&) const = default;
  };
  std::vector<Tile> tiles_;
  bool keep_relative_ = false;
};

}  // namespace ls::coordinator
