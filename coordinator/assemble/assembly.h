// One job's image in the making: the film, the accepted partials that wait for an earlier round, the error
// figures, the costs. Not thread-safe; the service holds its lock. image() is a cheap copy to work on outside
// of it.
#pragma once

#include <atomic>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/image/film.h"
#include "coordinator/assemble/health_book.h"
#include "coordinator/assemble/round_errors.h"
#include "coordinator/assemble/unit_costs.h"
#include "coordinator/store/partial_log.h"

namespace ls::coordinator {

// An accepted partial that is not folded yet. Without pixels it is read from the log.
struct WaitingPartial {
  std::optional<Partial> partial;
  std::optional<PartialLog::Place> place;
  SampleRange samples;
  Digest digest;
  Health health;
  TimePoint arrived{};  // its zero: before this start
};

// The bytes that pixels of waiting partials take, of one job; counted for the whole process, too.
class WaitingBytes {
 public:
  WaitingBytes() = default;
  WaitingBytes(WaitingBytes&& other) noexcept : own_(std::exchange(other.own_, 0)) {}
  WaitingBytes& operator=(WaitingBytes&& other) noexcept {
    std::swap(own_, other.own_);
    return *this;
  }
  ~WaitingBytes() { all_ -= own_; }
  void add(std::size_t bytes) { own_ += bytes, all_ += bytes; }
  void remove(std::size_t bytes) { own_ -= bytes, all_ -= bytes; }
  static std::size_t all() { return all_; }

 private:
  static inline std::atomic<std::size_t> all_{0};
  std::size_t own_ = 0;
};

class Assembly {
 public:
  Assembly(TileGrid grid, bool keep_relative, AovSet aovs = {})
      : film_(grid, aovs), errors_(grid.count(), keep_relative), costs_(grid.count()) {}
  Assembly(Film film, RoundErrors errors, HealthBook health)
      : film_(std::move(film)),
        errors_(std::move(errors)),
        health_(std::move(health)),
        costs_(film_.grid().count()) {}

  // Keeps a partial until take(). Its pixels are dropped, if it has a place, when those of all jobs that wait
  // take kMaxPendingPartials; then they are read from the log again.
  void hold(TileIndex tile, RoundIndex round, WaitingPartial waiting);
  std::optional<WaitingPartial> take(TileIndex tile, RoundIndex round, SampleRange samples);
  void forget_round(RoundIndex round);  // a cut round was reopened: what waits of it is void
  void forget_waiting();
  void discard(TileIndex tile);  // all of it: it is folded again from round 0
  std::size_t waiting() const { return waiting_.size(); }
  bool holds(TileIndex tile, RoundIndex round) const { return waiting_.contains({tile, round}); }

  Result<TileError> fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting);

  const Film& film() const { return film_; }
  const RoundErrors& errors() const { return errors_; }
  const HealthBook& health() const { return health_; }
  UnitCosts& costs() { return costs_; }  // of accepted units, folded or not
  void checkpoint_taken(std::span<const RoundIndex> rounds) { errors_.checkpoint_taken(rounds); }
  // Rounds folded of each tile for a job of `spp` samples; a tail that was cut for fewer samples does not
  // count.
  std::vector<RoundIndex> rounds_for(std::uint64_t spp) const;
  std::uint64_t folds_since_snapshot = 0;

 private:
  Film film_;
  RoundErrors errors_;
  HealthBook health_;
  UnitCosts costs_;
  std::map<std::pair<TileIndex, RoundIndex>, WaitingPartial> waiting_;
  WaitingBytes waiting_bytes_;
};

}  // namespace ls::coordinator
