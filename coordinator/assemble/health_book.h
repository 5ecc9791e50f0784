// The numeric health of what is folded of a job. Like the film it is a function of the folded units alone:
// what was rendered twice, or never folded, is not in it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/image/health.h"

namespace ls::coordinator {

class HealthBook {
 public:
  // A cut round's is kept apart: a longer range of the same round takes its place, as its pixels do.
  void folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health);
  void discard(TileIndex tile);  // it is folded again from round 0
  Health total() const;

  std::string save() const;
  std::string save_tile(TileIndex tile) const;  // load() takes those of all tiles one after the other
  static std::optional<HealthBook> load(std::string_view text);  // nothing: damaged
  bool operator==(const HealthBook&) const = default;

 private:
  std::map<TileIndex, Health> full_, tails_;  // those that aren't clean
};

}  // namespace ls::coordinator
