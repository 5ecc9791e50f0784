// The image of one unfinished job: the film (the sums of all folded samples), the accepted partials that wait
// for an earlier round of their tile, the errors and the costs. A partial is the encoded pixel sums of one
// unit, that is, of one round (range of samples) of one tile; to fold it is to add it to the film. Not
// thread-safe; guarded by the service's lock. The film is cheap to copy for work outside the lock.
#pragma once

#include <atomic>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/image/film/film.h"
#include "common/image/film/health.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "coordinator/assemble/round_errors.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

// Numeric health (counts of invalid values) of the units in a job's film (its image); a unit is one round
// (range of samples) of one tile. Each unit in the film counts once, even if it was rendered twice.
class HealthTable {
 public:
  // Adds the health of a unit that was added to the film. The health of a truncated round is kept separately:
  // if the round is folded again with more samples, its new health replaces the old one, as its pixels do.
  void folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health);
  void discard(TileIndex tile);  // removes the health of a tile that begins again without samples
  Health total() const;

  std::string save() const;
  std::string save_tile(TileIndex tile) const;  // load() also accepts the joined texts of several tiles
  static std::optional<HealthTable> load(std::string_view text);  // nullopt: the text is damaged
  bool operator==(const HealthTable&) const = default;

 private:
  // The health of a tile's full rounds, and that of its truncated last round; only of tiles with invalid
  // values
  std::map<TileIndex, Health> full_, tails_;
};

// The CPU cost of an image's units; a unit is one round (range of samples) of one tile. The cost of a
// checkpoint (the image with a given number of rounds for each tile) is the sum over its units, even if some
// tiles already have later rounds.
class UnitCosts {
 public:
  explicit UnitCosts(TileIndex tiles = 0) : tiles_(tiles) {}

  // Adds the core seconds of an accepted unit. A unit that is rendered again, for example because its round
  // was truncated, adds its cost each time.
  void add(TileIndex tile, RoundIndex round, double core_seconds);
  // Returns the core seconds of the units in the first `rounds[tile]` rounds of each tile. Units that an
  // earlier call included stay included, so the result never decreases.
  double until(std::span<const RoundIndex> rounds);

 private:
  struct Tile {
    RoundIndex summed = 0;     // number of rounds included in sum_
    std::vector<float> ahead;  // core seconds of the rounds from `summed` on
  };
  std::vector<Tile> tiles_;
  double sum_ = 0;
};

// An accepted partial (encoded pixel sums of a unit) that is not in the film yet. If `partial` is empty, its
// pixels are read from `place` in the log.
struct WaitingPartial {
  std::optional<Partial> partial;
  std::optional<PartialLog::Place> place;
  SampleRange samples;
  Digest digest;
  Health health;
  TimePoint arrived{};  // zero if it arrived before this start of the coordinator
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
  // drops the waiting partials of this round, which was truncated and is rendered again in full
  void forget_round(RoundIndex round);
  void forget_waiting();
  void discard(TileIndex tile);  // drops all data of the tile, which begins again without samples
  std::size_t waiting() const { return waiting_.size(); }

  Result<TileError> fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting);

  const Film& film() const { return film_; }
  const RoundErrors& errors() const { return errors_; }
  const HealthTable& health() const { return health_; }
  UnitCosts& costs() { return costs_; }  // costs of accepted units, whether or not they are in the film
  void checkpoint_taken(std::span<const RoundIndex> rounds) { errors_.checkpoint_taken(rounds); }
  // Returns for each tile how many of its rounds in the film a job of `spp` samples per pixel can use. A last
  // round that was truncated counts only if `spp` truncates it at the same sample.
  std::vector<RoundIndex> rounds_for(std::uint64_t spp) const;
  std::uint64_t folds_since_snapshot = 0;

 private:
  template <class Unwanted>
  void forget_if(Unwanted&& unwanted);  // drops waiting partials by tile and round

  Film film_;
  RoundErrors errors_;
  HealthTable health_;
  UnitCosts costs_;
  std::map<std::pair<TileIndex, RoundIndex>, WaitingPartial> waiting_;
  WaitingBytes waiting_bytes_;
};

}  // namespace ls::coordinator
