// The error sums of every tile after every fold, as far as they are still needed: a checkpoint says how many
// rounds of each tile count, and sums what each said after those, though some are ahead already. So the
// figures of a checkpoint do not depend on the order of arrival.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/image/error_estimate.h"

namespace ls::coordinator {

class RoundErrors {
 public:
  // `keep_relative`: also keep each fold's relative error sum for good, which the farm's stopping needs after
  // a restart.
  RoundErrors(TileIndex tiles, bool keep_relative) : tiles_(tiles), keep_relative_(keep_relative) {}

  // Rounds of a tile in order; a round given again (a cut one, now in full) replaces what was said of it.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // Summed in tile order, `rounds` of each tile. One that has less counts with what it has; one of which only
  // later rounds are kept, since it was ahead at a checkpoint that has been taken, with the first of those.
  TileError at(std::span<const RoundIndex> rounds) const;
  // Whether at() is what it was when these rounds were the last: nothing that it needs has been forgotten.
  bool knows(std::span<const RoundIndex> rounds) const;
  void discard(TileIndex tile) { tiles_[tile] = {}; }         // it is folded again from round 0
  void checkpoint_taken(std::span<const RoundIndex> rounds);  // at() will not be asked for fewer again

  // [round][tile]; empty unless kept. Tiles that have not reached a round stand with 0.
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
