// CPU cost of the units of an image: the cost of a checkpoint is that of the units in it, even if other units
// are ahead already.
#pragma once

#include <span>
#include <vector>

#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls::coordinator {

class UnitCosts {
 public:
  explicit UnitCosts(TileIndex tiles = 0) : tiles_(tiles) {}

  // Adds the core seconds of an accepted unit. A unit rendered again, e.g. of a truncated round, adds each
  // time.
  void add(TileIndex tile, RoundIndex round, double core_seconds);
  // Cost of all units in the first `rounds` of each tile or of earlier calls: the result never decreases.
  double until(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    RoundIndex summed = 0;     // rounds included in sum_
    std::vector<float> ahead;  // cost of later rounds
  };
  std::vector<Tile> tiles_;
  double sum_ = 0;
};

}  // namespace ls::coordinator
