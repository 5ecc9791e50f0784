// The pictures of tiles that a comparison with a reference still needs. A checkpoint gives the number of
// rounds of each tile that count, and shows every tile as it was then, even if some are ahead already. Like
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
  // Tiles that are partly folded already (after a restart) are known from their last round on.
  explicit ReferenceTiles(const Film& film);

  // Call after each fold, when `film` includes it.
  void folded(TileIndex tile, RoundIndex round, const Film& film);
  // Pictures after `rounds` of each tile, or after all it has if that is less. nullopt: the picture of some
  // tile is lost, because the coordinator was restarted meanwhile.
  std::optional<std::vector<TilePicture>> at(std::span<const RoundIndex> rounds) const;
  void discard(TileIndex tile) { tiles_[tile].rounds.clear(); }  // the tile is folded again from round 0
  std::optional<std::vector<TilePicture>> latest() const;
  // at() will not be called with fewer rounds again
  void checkpoint_taken(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    PixelRect rect;
    std::vector<std::pair<RoundIndex, std::shared_ptr<const std::vector<float>>>> rounds;  // ascending
  };
  std::vector<Tile> tiles_;
};

// The whole frame, interleaved, row by row.
std::vector<float> joined(const std::vector<TilePicture>& tiles, FrameSize frame);

}  // namespace ls::coordinator
