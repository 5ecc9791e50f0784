// A job whose tiles need different numbers of samples.
#pragma once

#include <random>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {

// Returns the error sum of a tile. Tiles have 32 x 32 pixels and variances of 1/8 to 16; every round scatters
// independently.
inline double uneven_error(const UnitKey& unit) {
  std::mt19937_64 random(99 + 1000003 * unit.tile + unit.round);
  const double scatter = std::uniform_real_distribution(.7, 1.4)(random);
  return scatter * std::exp2(static_cast<double>(unit.tile % 8) - 3) * 3 * 32 * 32 /
         static_cast<double>(round_range(unit.round).s1);
}
inline double uneven_error_of(TileIndex t, RoundIndex k) { return uneven_error({{"j"}, t, k}); }

inline JobPlan uneven_plan(double target) {
  JobPlan plan;
  plan.brief.job = {"j"};
  plan.grid = {{32 * 9, 32 * 2}, 32};
  plan.target_error = target;
  return plan;
}

inline std::vector<RoundIndex> ends_in(const Rig& rig) {
  std::vector<RoundIndex> ends;
  for (TileIndex t = 0; t < 18; ++t) ends.push_back(tile_figures(rig.farm, {"j"}, t)->rounds_folded);
  return ends;
}

}  // namespace ls::coordinator
