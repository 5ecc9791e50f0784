// One job's image in the making: the film, the accepted partials that wait for an earlier round, the error
// figures. Not thread-safe; the service holds its lock. image() is a cheap copy to work on outside of it.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/image/film.h"
#include "coordinator/assemble/health_book.h"
#include "coordinator/assemble/round_errors.h"
#include "coordinator/store/partial_log.h"

namespace ls::coordinator {

// An accepted partial that is not folded yet. Without pixels it is read from the log.
struct WaitingPartial {
  std::optional<Partial> partial;
  std::optional<PartialLog::Place> place;
  SampleRange samples;
  Digest digest;
  Health health;
};

class Assembly {
 public:
  Assembly(TileGrid grid, bool keep_relative, AovSet aovs = {})
      : film_(grid, aovs), errors_(grid.count(), keep_relative) {}
  Assembly(Film film, RoundErrors errors, HealthBook health)
      : film_(std::move(film)), errors_(std::move(errors)), health_(std::move(health)) {}

  // Keeps a partial until take(). Its pixels are dropped, if it has a place, when too many wait
  // (kMaxPendingPartials).
  void hold(TileIndex tile, RoundIndex round, WaitingPartial waiting);
  std::optional<WaitingPartial> take(TileIndex tile, RoundIndex round, SampleRange samples);
  void forget_round(RoundIndex round);  // a cut round was reopened: what waits of it is void
  void forget_waiting();
  bool holds(TileIndex tile, RoundIndex round) const { return waiting_.contains({tile, round}); }

  Result<TileError> fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting);

  const Film& film() const { return film_; }
  const RoundErrors& errors() const { return errors_; }
  const HealthBook& health() const { return health_; }
  void checkpoint_taken(std::span<const RoundIndex> rounds) { errors_.checkpoint_taken(rounds); }
  // Rounds folded of each tile for a job of `spp` samples; a tail that was cut for fewer samples does not
  // count.
  std::vector<RoundIndex> rounds_for(std::uint64_t spp) const;
  std::uint64_t folds_since_snapshot = 0;

 private:
  Film film_;
  RoundErrors errors_;
  HealthBook health_;
  std::map<std::pair<TileIndex, RoundIndex>, WaitingPartial> waiting_;
  std::size_t waiting_bytes_ = 0;
};

// The folded state as a file: {"LSSNAP1\n", build, film, error figures, health}, closed by a SHA-256.
// Returned as nothing if it is missing, damaged, of another grid, other AOVs or another build: then
// everything is folded again from the partials.
std::vector<std::byte> save_snapshot(const Film& film, const RoundErrors& errors, const HealthBook& health,
                                     std::string_view build);
std::optional<Assembly> load_snapshot(std::span<const std::byte> bytes, const TileGrid& grid,
                                      bool keep_relative, std::string_view build, AovSet aovs = {});

}  // namespace ls::coordinator
