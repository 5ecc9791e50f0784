// The units of a job that wait for a worker. Each tile has its own end, since tiles of an adaptive job stop
// after different numbers of rounds. Of a tile wait all rounds from `next` to its end, and those before it
// that came back. Lower rounds go first, so that a whole picture is there early.
//
// Every operation costs O(log tiles) at most, amortised; 20 bytes a tile.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <set>
#include <vector>

#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

class UnitQueue {
 public:
  UnitQueue(TileIndex tiles, RoundIndex rounds)
      : next_(tiles),
        end_(tiles, rounds),
        window_(tiles, kNoWindow),
        planned_(std::uint64_t{rounds} * tiles) {
    for (TileIndex t = 0; t < tiles; ++t) offer(t);
  }

  TileIndex tiles() const { return static_cast<TileIndex>(next_.size()); }
  // Rounds of the tile that belong to the job.
  RoundIndex end(TileIndex tile) const { return end_[tile]; }
  RoundIndex longest() const { return *std::max_element(end_.begin(), end_.end()); }
  bool plans(UnitCode code) const { return round_of(code) < end_[tile_of(code)]; }
  std::uint64_t planned() const { return planned_; }
  void set_end(TileIndex tile, RoundIndex rounds) {
    planned_ += rounds;
    planned_ -= end_[tile];
    const bool was_open = open(tile);
    end_[tile] = rounds;
    forget_from(tile, rounds);
    if (!was_open) offer(tile);
  }
  // Rounds of the tile from `window` on wait until it is moved.
  void set_window(TileIndex tile, RoundIndex window) {
    const bool was_open = open(tile);
    window_[tile] = window;
    if (!was_open) offer(tile);
  }

  // Before it every round of the tile has been handed out at least once, or accepted.
  RoundIndex next(TileIndex tile) const { return next_[tile]; }
  // The tile's rounds from `round` on wait again.
  void rewind(TileIndex tile, RoundIndex round) {
    forget_from(tile, round);
    if (round >= next_[tile]) return;
    next_[tile] = round;
    offer(tile);
  }

  // The first waiting unit for which `excluded` is false; exclusion applies to units that came back only.
  template <class Excluded>
  std::optional<UnitCode> front(const UnitTable& units, Excluded&& excluded) {
    for (const UnitCode code : returned_) {
      if (!excluded(code)) return code;
    }
    while (!heads_.empty()) {
      const UnitCode code = heads_.top();
      if (!waits(code)) {
        heads_.pop();
      } else if (units.accepted(code)) {
        step();
      } else {
        return code;
      }
    }
    return std::nullopt;
  }
  bool empty(const UnitTable& units) {
    return !front(units, [](UnitCode) { return false; });
  }
  // Takes out what front() gave.
  void pop(UnitCode code) {
    if (!heads_.empty() && code == heads_.top() && waits(code))
      step();
    else
      returned_.erase(code);
  }
  // A lent unit waits again.
  void put_back(UnitCode code) {
    if (plans(code) && round_of(code) < next_[tile_of(code)]) returned_.insert(code);
  }
  // A late result came for a unit that may be waiting.
  void forget(UnitCode code) { returned_.erase(code); }
  const std::set<UnitCode>& returned() const { return returned_; }

 private:
  static constexpr RoundIndex kNoWindow = std::numeric_limits<RoundIndex>::max();

  bool open(TileIndex t) const { return next_[t] < std::min(end_[t], window_[t]); }
  bool waits(UnitCode code) const { return open(tile_of(code)) && round_of(code) == next_[tile_of(code)]; }
  // heads_ holds the next unit of every open tile, and dead ones among them, which front() drops.
  void offer(TileIndex tile) {
    if (open(tile)) heads_.push(unit_code(next_[tile], tile));
  }
  void step() {
    const TileIndex tile = tile_of(heads_.top());
    heads_.pop();
    ++next_[tile];
    offer(tile);
  }
  void forget_from(TileIndex tile, RoundIndex round) {
    if (returned_.empty()) return;
    for (RoundIndex k = round; k < next_[tile]; ++k) returned_.erase(unit_code(k, tile));
  }

  std::vector<RoundIndex> next_, end_, window_;
  std::uint64_t planned_;
  std::priority_queue<UnitCode, std::vector<UnitCode>, std::greater<>> heads_;
  std::set<UnitCode> returned_;
};

}  // namespace ls::coordinator
