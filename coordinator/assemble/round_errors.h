// Keeps for each tile what checkpoints need: its error sums (RoundErrors) and, for comparisons with a
// reference image, its pictures (ReferenceTiles). A round is a range of samples. Folding adds a tile's next
// round to the film (the image in memory). A checkpoint gives a number of rounds for each tile. It shows
// every tile as it was after these rounds, even if some tiles already have later ones.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/image/error/error_estimate.h"
#include "core/image/film/film.h"

namespace ls::coordinator {

// Appends the bytes of `value`.
template <class T>
void append_value(std::vector<std::byte>& out, const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

// Keeps the error sums that each tile had after each round, until no later checkpoint needs them. So the
// errors of a checkpoint do not depend on the order in which results arrive.
class RoundErrors {
 public:
  // `keep_relative`: the relative error sum (TileError::relative.squares) after every round is kept forever,
  // even if no checkpoint needs it. A job with a target error needs these sums after a restart: they are
  // passed to its stop rule again.
  RoundErrors(TileIndex tiles, bool keep_relative) : tiles_(tiles), keep_relative_(keep_relative) {}

  // Adds the tile's error after this round. The rounds of a tile come in order. If a truncated round comes
  // again in full, its new error replaces the old one.
  void folded(TileIndex tile, RoundIndex round, const TileError& error);
  // Returns the sum of all tiles' errors, added in tile order. Each tile counts with its error after
  // `rounds[tile]` rounds, or after its latest round if it has fewer. If the error that is needed has been
  // dropped, the next later one that is kept counts.
  TileError at(std::span<const RoundIndex> rounds) const;
  // True if at(rounds) is exact: all errors that it needs are still there.
  bool knows(std::span<const RoundIndex> rounds) const;
  // Drops the errors of a tile whose image restarts from zero samples
  void discard(TileIndex tile) { tiles_[tile] = {}; }
  // Drops errors that no later checkpoint needs. Later calls of at() must request at least `rounds[tile]`
  // rounds of every tile.
  void checkpoint_taken(std::span<const RoundIndex> rounds);

  // Returns the relative error sums as [round][tile]: the sum after each round of each tile, 0 if the tile
  // has not reached the round. Empty unless `keep_relative`.
  std::vector<std::vector<double>> relative() const;

  std::vector<std::byte> save_tile(TileIndex tile) const;
  Result<void> load_tile(TileIndex tile, std::span<const std::byte> bytes);
  bool operator==(const RoundErrors&) const = default;

 private:
  struct Tile {
    std::vector<std::pair<RoundIndex, TileError>> rounds;  // (round, error after it), by ascending round
    std::vector<double> relative;                          // relative[k]: relative error sum after round k
    bool operator==(const Tile&) const = default;
  };
  std::vector<Tile> tiles_;
  bool keep_relative_ = false;
};

using Picture = std::shared_ptr<const std::vector<float>>;  // R, G, B of each pixel, row by row
struct TilePicture {
  PixelRect rect;
  Picture rgb;
};

// Keeps the picture that each tile had after each round, until no later comparison with a reference image
// needs it. Sums of errors do not suffice: the perceived error (FLIP) is not a sum over tiles. Not
// thread-safe; but pictures are shared and immutable, so the result of at() may be used without a lock.
class ReferenceTiles {
 public:
  // Begins with the present picture of each tile in `film`. If `film` already has rounds (after a restart),
  // the pictures before the present one are unknown.
  explicit ReferenceTiles(const Film& film);

  // Keeps the tile's picture after this round. Call it after each round that is added to `film`.
  void folded(TileIndex tile, RoundIndex round, const Film& film);
  // Returns the picture of each tile after `rounds[tile]` rounds. A tile with fewer rounds gives its latest
  // picture. nullopt: the picture of some tile is lost, because the coordinator was restarted meanwhile.
  std::optional<std::vector<TilePicture>> at(std::span<const RoundIndex> rounds) const;
  // Drops the pictures of a tile whose image restarts from zero samples
  void discard(TileIndex tile) { tiles_[tile].rounds.clear(); }
  std::optional<std::vector<TilePicture>> latest() const;
  // Drops pictures that no later checkpoint needs. Later calls of at() must request at least `rounds[tile]`
  // rounds of every tile.
  void checkpoint_taken(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    PixelRect rect;
    std::vector<std::pair<RoundIndex, Picture>> rounds;  // (round, picture after it), by ascending round
  };
  std::vector<Tile> tiles_;
};

// Joins the pictures of all tiles into one of the whole frame: R, G, B of each pixel, row by row.
std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame);

}  // namespace ls::coordinator
