#include "coordinator/assemble/unit_costs.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace ls::coordinator {

void UnitCosts::add(TileIndex tile, RoundIndex round, double core_seconds) {
  Tile& t = tiles_[tile];
  if (round < t.summed) {
    sum_ += core_seconds;
    return;
  }
  const std::size_t place = round - t.summed;
  if (place >= t.ahead.size()) t.ahead.resize(place + 1);
  t.ahead[place] += static_cast<float>(core_seconds);
}

double UnitCosts::until(std::span<const RoundIndex> rounds) {
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    Tile& t = tiles_[i];
    if (rounds[i] <= t.summed) continue;
    const auto end = t.ahead.begin() +
                     static_cast<std::ptrdiff_t>(std::min<std::size_t>(rounds[i] - t.summed, t.ahead.size()));
    sum_ = std::accumulate(t.ahead.begin(), end, sum_);
    t.ahead.erase(t.ahead.begin(), end);
    t.summed = rounds[i];
  }
  return sum_;
}

}  // namespace ls::coordinator
