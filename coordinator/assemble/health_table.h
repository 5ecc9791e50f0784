// Numeric health (counts of invalid values) of a job's folded units; a unit is one round (range of samples)
// of one tile. Like the film, the image that the units are folded into, it depends on these alone: a unit
// that was rendered twice counts once, and one that was not folded does not count.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/image/film/health.h"

namespace ls::coordinator {

class HealthTable {
 public:
  // Adds the health of a folded unit. That of a truncated round is kept apart: if the same round is folded
  // again with more samples, the new health replaces it, as the new pixels replace the old.
  void folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health);
  void discard(TileIndex tile);  // drops the tile's health, since the tile is folded again from round 0
  Health total() const;

  std::string save() const;
  std::string save_tile(TileIndex tile) const;  // load() accepts the texts of all tiles one after the other
  static std::optional<HealthTable> load(std::string_view text);  // nullopt: the text is damaged
  bool operator==(const HealthTable&) const = default;

 private:
  std::map<TileIndex, Health> full_, tails_;  // of full and of truncated rounds; only tiles with problems
};

}  // namespace ls::coordinator
