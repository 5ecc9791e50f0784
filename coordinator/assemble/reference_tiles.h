// Keeps the pictures of tiles that a comparison with a reference image still needs. A round is a range of
// samples; folding adds a tile's next round to the image. A checkpoint says how many rounds of each tile
// count, and shows every tile as it was after these, even if some tiles are ahead already. This is like
// round_errors.h, but with whole pictures, since the perceived error (FLIP) is not a sum over tiles.
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
  std::shared_ptr<const std::vector<float>> rgb;  // interleaved, row by row
};

class ReferenceTiles {
 public:
  // Begins with the picture that `film` has of each tile. Of tiles that are partly folded already (after a
  // restart), earlier rounds are unknown.
  explicit ReferenceTiles(const Film& film);

  // Keeps the tile's picture after this round. Call after each fold, when `film` includes it.
  void folded(TileIndex tile, RoundIndex round, const Film& film);
  // Returns for each tile its picture after `rounds[tile]` rounds, or after all that it has if these are
  // fewer. nullopt: the picture of some tile is lost, because the coordinator was restarted meanwhile.
  std::optional<std::vector<TilePicture>> at(std::span<const RoundIndex> rounds) const;
  void discard(TileIndex tile) { tiles_[tile].rounds.clear(); }  // the tile is folded again from round 0
  std::optional<std::vector<TilePicture>> latest() const;
  // Drops pictures that are no longer needed: at() will not be called with fewer rounds of any tile again
  void checkpoint_taken(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    PixelRect rect;
    std::vector<std::pair<RoundIndex, std::shared_ptr<const std::vector<float>>>> rounds;  // ascending
  };
  std::vector<Tile> tiles_;
};

// Joins the tiles' pictures to one of the whole frame, interleaved, row by row.
std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame);

}  // namespace ls::coordinator
