// What the units of an image took: a checkpoint's cost is that of the units in it, though others are ahead
// already.
#pragma once

#include <span>
#include <vector>

#include "common/image/frame.h"
#include "common/image/rounds.h"

namespace ls::coordinator {

class UnitCosts {
 public:
  explicit UnitCosts(TileIndex tiles = 0) : tiles_(tiles) {}

  // Core seconds of an accepted unit. One that is rendered again, as of a cut round, has cost both times.
  void add(TileIndex tile, RoundIndex round, double core_seconds);
  // Of all units in the first `rounds` of each tile, and whatever they were asked for before: it never falls.
  double until(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    RoundIndex summed = 0;     // rounds that are in sum_
    std::vector<float> ahead;  // of those after them
  };
  std::vector<Tile> tiles_;
  double sum_ = 0;
};

}  // namespace ls::coordinator
