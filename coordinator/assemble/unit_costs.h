// The CPU cost of an image's units; a unit is one round (range of samples) of one tile. The cost of a
// checkpoint is that of the units in it, even if other units are ahead already.
#pragma once

#include <span>
#include <vector>

#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls::coordinator {

class UnitCosts {
 public:
  explicit UnitCosts(TileIndex tiles = 0) : tiles_(tiles) {}

  // Adds the core seconds of an accepted unit. A unit that is rendered again, e.g. one of a truncated round,
  // adds its cost each time.
  void add(TileIndex tile, RoundIndex round, double core_seconds);
  // Returns the core seconds of the units in the first `rounds[tile]` rounds of each tile. Units that an
  // earlier call included stay included, so the result never decreases.
  double until(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    RoundIndex summed = 0;     // number of rounds included in sum_
    std::vector<float> ahead;  // core seconds of each later round
  };
  std::vector<Tile> tiles_;
  double sum_ = 0;
};

}  // namespace ls::coordinator
