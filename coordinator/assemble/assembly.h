// The image of one unfinished job: the film (the sums of all folded samples), the accepted partials that wait
// for an earlier round of their tile, the errors of the tiles, and the CPU costs of the units. A partial is
// the encoded pixel sums of one unit; to fold it is to add it to the film. Not thread-safe; guarded by the
// service's lock. The film is cheap to copy for work outside the lock.
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

#include "coordinator/assemble/round_errors.h"
#include "coordinator/store/log/partial_log.h"
#include "core/base/clock.h"
#include "core/image/film/film.h"
#include "core/image/film/health.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls::coordinator {

// Numeric health (counts of invalid samples) of the units in a job's film (its image). Each unit in the film
// counts once, even if it was rendered twice.
class HealthTable {
 public:
  // Adds the health of a unit that was added to the film. The last round of a job may be truncated, with
  // fewer samples than a full round. Its health is kept separately: if the round is folded again with more
  // samples, its new health replaces the old one, as its new pixels replace the old ones.
  void folded(TileIndex tile, RoundIndex round, const SampleRange& samples, const Health& health);
  void discard(TileIndex tile);  // removes the tile's health; its image restarts from zero samples
  Health total() const;

  std::string save() const;
  // Returns the lines of save() for this tile. load() also reads the joined lines of several tiles.
  std::string save_tile(TileIndex tile) const;
  static std::optional<HealthTable> load(std::string_view text);  // nullopt: the text is damaged
  bool operator==(const HealthTable&) const = default;

 private:
  // By tile: the health of its full rounds (full_), and that of its truncated last round (tails_). Only tiles
  // with invalid samples have an entry
  std::map<TileIndex, Health> full_, tails_;
};

// The CPU cost of an image's units. The cost of a checkpoint (the image with a given number of rounds for
// each tile) is the sum over its units, even if some tiles already have later rounds.
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
    RoundIndex summed = 0;     // number of rounds whose cost is included in sum_
    std::vector<float> ahead;  // ahead[i]: core seconds of round summed + i
  };
  std::vector<Tile> tiles_;
  double sum_ = 0;
};

// An accepted partial (encoded pixel sums of a unit) that is not in the film yet. If `partial` is nullopt,
// the pixels are in the log of partials, at `place`.
struct WaitingPartial {
  std::optional<Partial> partial;
  std::optional<PartialLog::Place> place;
  SampleRange samples;
  Digest digest;
  Health health;
  TimePoint arrived{};  // zero if it arrived before the coordinator's latest start
};

// Counts the bytes that the pixels of one job's waiting partials occupy in memory. all() is the sum over all
// jobs of the process.
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

  // Keeps a partial until take() returns it. If the waiting partials of all jobs would exceed
  // kMaxPendingPartials bytes, and this one is stored in the log, its pixels are dropped from memory and read
  // from the log later.
  void hold(TileIndex tile, RoundIndex round, WaitingPartial waiting);
  std::optional<WaitingPartial> take(TileIndex tile, RoundIndex round, SampleRange samples);
  // Drops the waiting partials of this round of all tiles: it was truncated, and is rendered again in full
  void forget_round(RoundIndex round);
  void forget_waiting();
  void discard(TileIndex tile);  // drops all data of the tile; its image restarts from zero samples
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
  void forget_if(Unwanted&& unwanted);  // drops waiting partials for which unwanted(tile, round) is true

  Film film_;
  RoundErrors errors_;
  HealthTable health_;
  UnitCosts costs_;
  std::map<std::pair<TileIndex, RoundIndex>, WaitingPartial> waiting_;
  WaitingBytes waiting_bytes_;
};

}  // namespace ls::coordinator
