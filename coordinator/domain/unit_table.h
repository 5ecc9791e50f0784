// The state of one job's units: accepted results (digest and worker, 36 bytes per unit, allocated round by
// round as rounds begin) and how far each tile is folded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/digest.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls::coordinator {

// (round, tile) in one number, ordered as units are rendered: every tile's round 0, then every tile's round
// 1...
using UnitCode = std::uint64_t;
constexpr UnitCode unit_code(RoundIndex round, TileIndex tile) { return UnitCode{round} << 32 | tile; }
constexpr RoundIndex round_of(UnitCode code) { return static_cast<RoundIndex>(code >> 32); }
constexpr TileIndex tile_of(UnitCode code) { return static_cast<TileIndex>(code); }

using WorkerIndex = std::uint32_t;
inline constexpr WorkerIndex kNoWorker = ~WorkerIndex{0};

class UnitTable {
 public:
  struct Result {
    Digest digest;  // all zero: unknown (folded before a restart that lost the record)
    WorkerIndex worker = kNoWorker;
  };

  explicit UnitTable(TileIndex tiles) : tiles_(tiles), issued_(tiles), folded_(tiles) {}

  TileIndex tiles() const { return tiles_; }

  // Accepted results
  const Result* find(UnitCode code) const;  // null: not accepted
  bool accepted(UnitCode code) const { return find(code) != nullptr; }
  void accept(UnitCode code, const Result& result);  // the unit must not be accepted yet
  std::uint64_t accepted_count() const { return accepted_count_; }
  RoundIndex end_of_accepted(TileIndex tile) const;  // one past its last accepted round
  // Forgets results accepted from `end` on; none of them may be folded
  void truncate(TileIndex tile, RoundIndex end);
  void reopen(RoundIndex round);  // forgets round `round`, accepted or folded; no later round may be known
  // Forgets all results and folds of the tile. Returns the units that were accepted, ascending.
  std::vector<UnitCode> void_tile(TileIndex tile);
  // Tiles with an accepted result of this worker, ascending
  std::vector<TileIndex> tiles_of(WorkerIndex worker) const;
  void mark_workers(std::vector<bool>& used) const;  // sets used[worker] for the workers of accepted results
  void forget_results();  // for a failed job: frees the memory, keeps the fold counts

  // Folding

  // Returns the tile's next round if it is accepted, below `end` and at most `limit`, and counts it as issued
  // from now on.
  std::optional<RoundIndex> issue_fold(TileIndex tile, RoundIndex limit, RoundIndex end);
  RoundIndex issued(TileIndex tile) const { return issued_[tile]; }  // number of folds requested
  // False if `round` is not the next issued round to be folded.
  bool fold(TileIndex tile, RoundIndex round, double rel_error_sum);
  void restore_folded(TileIndex tile, RoundIndex rounds);
  void restore_error(RoundIndex round, TileIndex tile, double rel_error_sum);
  RoundIndex folded(TileIndex tile) const { return folded_[tile]; }
  std::uint64_t folded_count() const { return folded_count_; }
  RoundIndex rounds_complete() const { return rounds_complete_; }  // rounds folded in all tiles
  double error(RoundIndex round, TileIndex tile) const;            // NaN: unknown

 private:
  struct Round {
    std::vector<Result> results;
    std::vector<double> errors;
    TileIndex accepted = 0, folded = 0;
  };
  Round& round(RoundIndex index);
  void settle_complete();

  TileIndex tiles_;
  std::vector<Round> rounds_;
  std::vector<RoundIndex> issued_, folded_;
  std::uint64_t accepted_count_ = 0, folded_count_ = 0;
  RoundIndex rounds_complete_ = 0;
};

}  // namespace ls::coordinator
