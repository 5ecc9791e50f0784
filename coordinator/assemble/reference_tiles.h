// Keeps the pictures of tiles that a comparison with a reference image still needs. A round is a range of
// samples; folding adds a tile's next round to the image. A checkpoint gives a number of rounds for each
// tile, and shows every tile as it was after these rounds, even if some tiles already have later ones.
// RoundErrors (round_errors.h) does the same with sums of errors; this class keeps whole pictures, since the
// perceived error (FLIP) is not a sum over tiles.
//
// Not thread-safe. Pictures are shared and immutable: the result of at() may be used without a lock.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/image/film/film.h"

namespace ls::coordinator {

struct TilePicture {
  PixelRect rect;
  std::shared_ptr<const std::vector<float>> rgb;  // pixels row by row, three values each
};

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
    std::vector<std::pair<RoundIndex, std::shared_ptr<const std::vector<float>>>> rounds;  // ascending
  };
  std::vector<Tile> tiles_;
};

// Joins the pictures of all tiles to one of the whole frame: pixels row by row, three values each.
std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame);

}  // namespace ls::coordinator
