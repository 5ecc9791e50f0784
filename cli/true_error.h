// The true error of an image against a reference, at each checkpoint (a round over all tiles) of its
// convergence.
//   rmse = sqrt(mean over pixels and channels of (x - ref)^2), relmse = mean of (x - ref)^2 / (ref^2 + 0.01)
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/image/exr_file.h"
#include "common/image/film.h"

namespace ls::cli {

class TrueError {
 public:
  // invalid_argument: the reference has another size or values that are not finite.
  static Result<TrueError> make(TileGrid grid, RgbImage reference);

  // In any order; a unit given again is ignored.
  Result<void> add(TileIndex tile, RoundIndex round, Partial partial);

  struct Point {
    double spp = 0;  // mean over pixels
    double rmse = 0, relmse = 0;
  };
  // Checkpoints in order of rounds, with no more rounds of a tile than `folded` says: a tile that stopped
  // early stands with its last figures. Empty if a tile has none.
  std::vector<Point> points(std::span<const RoundIndex> folded) const;

 private:
  struct Figures {
    std::uint64_t spp = 0;
    double squares = 0, relative = 0;  // sums over pixels and channels
  };
  TrueError(TileGrid grid, RgbImage reference)
      : film_(grid), reference_(std::move(reference)), rounds_(grid.count()) {}
  Figures figures(TileIndex tile) const;

  Film film_;
  RgbImage reference_;
  std::vector<std::vector<Figures>> rounds_;                     // of each tile
  std::map<std::pair<TileIndex, RoundIndex>, Partial> waiting_;  // for an earlier round
};

}  // namespace ls::cli
