// Numeric health of a job's folded units. Like the film it depends on these alone: units rendered twice, or
// never folded, are not included.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/image/film/health.h"

namespace ls::coordinator {

class HealthTable {
 public:
  // A truncated round's health is kept apart: a longer range of the same round replaces it, as it does its
  // pixels.
  void folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health);
  void discard(TileIndex tile);  // the tile is folded again from round 0
  Health total() const;

  std::string save() const;
  std::string save_tile(TileIndex tile) const;  // load() accepts the concatenation over all tiles
  static std::optional<HealthTable> load(std::string_view text);  // nullopt: damaged
  bool operator==(const HealthTable&) const = default;

 private:
  std::map<TileIndex, Health> full_, tails_;  // only tiles with problems
};

}  // namespace ls::coordinator
