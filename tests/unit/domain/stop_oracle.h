// Computes where the tiles of a job with a target error must end, from their errors alone: feeds the stop
// rule with every tile's rounds in order, one tile after the other.
#pragma once

#include <functional>
#include <vector>

#include "coordinator/domain/adaptive_stop.h"

namespace ls::coordinator {

// Returns TileError::relative.squares of a tile after a round
using ErrorOf = std::function<double(TileIndex, RoundIndex)>;

struct StopOutcome {
  std::vector<RoundIndex> ends;
  bool by_error = false;
  double predicted = 0, mean_spp = 0;
};

// Feeds the rule with the rounds of each tile that are certain to be needed. `seen` is the number of rounds
// of each tile so far.
inline void feed_wanted(AdaptiveStop& rule, std::vector<RoundIndex>& seen, const ErrorOf& error) {
  for (TileIndex t = 0; t < seen.size(); ++t)
    for (; seen[t] <= rule.wanted(t); ++seen[t]) rule.folded(t, seen[t], error(t, seen[t]));
}

inline StopOutcome stop_at(AdaptiveStop& rule, std::vector<RoundIndex>& seen, double target,
                           const ErrorOf& error) {
  while (true) {
    while (rule.judge(target) == AdaptiveStop::Verdict::unknown) feed_wanted(rule, seen, error);
    const bool good = rule.judge(target) == AdaptiveStop::Verdict::yes && !rule.exhausted();
    if (good || rule.exhausted()) return {rule.ends(), good, rule.predicted(), rule.mean_spp()};
    rule.lower();
  }
}

inline StopOutcome stop_at_once(const TileGrid& grid, std::uint64_t spp, double target,
                                const ErrorOf& error) {
  AdaptiveStop rule(grid, spp);
  std::vector<RoundIndex> seen(grid.count());
  return stop_at(rule, seen, target, error);
}

}  // namespace ls::coordinator
