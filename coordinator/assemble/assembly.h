// The image of one unfinished job: the film (the sums of all folded samples), the accepted partials that wait
// for an earlier round of their tile, the errors and the costs. A partial is the encoded pixel sums of one
// unit, that is, of one round (range of samples) of one tile; to fold it is to add it to the film. Not
// thread-safe; guarded by the service's lock. The film is cheap to copy for work outside the lock.
#pragma once

#include <atomic>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/image/film/film.h"
#include "coordinator/assemble/health_table.h"
#include "coordinator/assemble/round_errors.h"
#include "coordinator/assemble/unit_costs.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

// An accepted partial that is not folded yet. If `partial` is empty, its pixels are read from `place` in the
// log.
struct WaitingPartial {
  std::optional<Partial> partial;
  std::optional<PartialLog::Place> place;
  SampleRange samples;
  Digest digest;
  Health health;
  TimePoint arrived{};  // zero: it arrived before this start of the coordinator
};

// Counts the bytes of the pixels of one job's waiting partials. all() is the sum over all jobs of the
// process.
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
  Assembly(Film film, RoundErrors errors, HealthTable health)
      : film_(std::move(film)),
        errors_(std::move(errors)),
        health_(std::move(health)),
        costs_(film_.grid().count()) {}

  // Keeps a partial until take(). If it has a place in the log and the waiting pixels of all jobs exceed
  // kMaxPendingPartials, its pixels are dropped and read from the log later.
  void hold(TileIndex tile, RoundIndex round, WaitingPartial waiting);
  std::optional<WaitingPartial> take(TileIndex tile, RoundIndex round, SampleRange samples);
  void forget_round(RoundIndex round);  // drops waiting partials of a truncated round that was reopened
  void forget_waiting();
  void discard(TileIndex tile);  // drops all of the tile: it is folded again from round 0
  std::size_t waiting() const { return waiting_.size(); }
  bool holds(TileIndex tile, RoundIndex round) const { return waiting_.contains({tile, round}); }

  Result<TileError> fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting);

  const Film& film() const { return film_; }
  const RoundErrors& errors() const { return errors_; }
  const HealthTable& health() const { return health_; }
  UnitCosts& costs() { return costs_; }  // costs of accepted units, folded or not
  void checkpoint_taken(std::span<const RoundIndex> rounds) { errors_.checkpoint_taken(rounds); }
  // Returns for each tile how many rounds are folded that a job of `spp` samples per pixel can use. A
  // truncated last round (tail) that was cut for fewer samples does not count.
  std::vector<RoundIndex> rounds_for(std::uint64_t spp) const;
  std::uint64_t folds_since_snapshot = 0;

 private:
  Film film_;
  RoundErrors errors_;
  HealthTable health_;
  UnitCosts costs_;
  std::map<std::pair<TileIndex, RoundIndex>, WaitingPartial> waiting_;
  WaitingBytes waiting_bytes_;
};

}  // namespace ls::coordinator
