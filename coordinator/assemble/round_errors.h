// Keeps what checkpoints need of tiles: their error sums (RoundErrors) and, to compare them with a reference
// image, their pictures (ReferenceTiles). A round is a range of samples; folding adds a tile's next round to
// the image. A checkpoint gives a number of rounds for each tile. It shows every tile as it was after these
// rounds, even if some tiles already have later ones.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/image/error/error_estimate.h"
#include "common/image/film/film.h"

namespace ls::coordinator {

// Appends the bytes of `value`.
template <class T>
void append_value(std::vector<std::byte>& out, const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

// Error sums, as long as checkpoints need them. So the errors of a checkpoint do not depend on the order in
// which results arrive.
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

using Picture = std::shared_ptr<const std::vector<float>>;  // pixels row by row, three values each
struct TilePicture {
  PixelRect rect;
  Picture rgb;
};

// Pictures of tiles, as long as a comparison with a reference image needs them. Sums of errors do not
// suffice: the perceived error (FLIP) is not a sum over tiles. Not thread-safe; but pictures are shared and
// immutable, so the result of at() may be used without a lock.
class ReferenceTiles {
 public:
  // Starts with the picture of each tile in `film`. If `film` has rounds already (after a restart), the
  // tiles' earlier pictures are unknown.
  explicit ReferenceTiles(const Film& film);

  // Keeps the tile's picture after this round. Call it after each round that is added to `film`.
  void folded(TileIndex tile, RoundIndex round, const Film& film);
  // Returns the picture of each tile after `rounds[tile]` rounds. A tile with fewer rounds gives its latest
  // picture. nullopt: the picture of some tile is lost, because the coordinator was restarted meanwhile.
  std::optional<std::vector<TilePicture>> at(std::span<const RoundIndex> rounds) const;
  // Called when the tile begins again without samples
  void discard(TileIndex tile) { tiles_[tile].rounds.clear(); }
  std::optional<std::vector<TilePicture>> latest() const;
  // Drops pictures that no later checkpoint needs. Later calls of at() must request at least `rounds[tile]`
  // rounds of every tile.
  void checkpoint_taken(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    PixelRect rect;
    std::vector<std::pair<RoundIndex, Picture>> rounds;  // ascending
  };
  std::vector<Tile> tiles_;
};

// Joins the pictures of all tiles to one of the whole frame: pixels row by row, three values each.
std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame);

}  // namespace ls::coordinator
