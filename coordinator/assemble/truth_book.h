// The pictures of tiles that a comparison with a reference still needs: a checkpoint says how many rounds of
// each tile count, and shows every tile as it was then, though some are ahead already. (As round_errors.h,
// but whole pictures: what is seen of an error is not a sum over tiles.)
//
// Not thread-safe. Pictures are shared and never change: what at() gives can be worked on without a lock.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/image/film.h"

namespace ls::coordinator {

struct TilePicture {
  PixelRect rect;
  std::shared_ptr<const std::vector<float>> rgb;  // interleaved, row by row
};

class TruthBook {
 public:
  // Tiles that have something folded already (a restart) are known from their last round on.
  explicit TruthBook(const Film& film);

  // After each fold; `film` has it already.
  void folded(TileIndex tile, RoundIndex round, const Film& film);
  // With `rounds` of each tile, or what it has if that is less. Nothing: a tile's picture of then is not
  // known, because the coordinator was restarted meanwhile.
  std::optional<std::vector<TilePicture>> at(std::span<const RoundIndex> rounds) const;
  void discard(TileIndex tile) { tiles_[tile].rounds.clear(); }  // it is folded again from round 0
  std::optional<std::vector<TilePicture>> latest() const;
  void checkpoint_taken(std::span<const RoundIndex> rounds);  // at() will not be asked for fewer again

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
