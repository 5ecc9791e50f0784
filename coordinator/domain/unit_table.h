// The state of one job's units. For each unit the table keeps the accepted result (digest and worker, 36
// bytes per unit, allocated when a round begins), and for each tile the number of rounds that are folded,
// that is, added to the image. Terms: docs/reference/glossary.md.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/digest.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls::coordinator {

// A unit as one number, made of its round and tile. Numbers ascend in the order in which units are rendered:
// every tile's round 0, then every tile's round 1...
using UnitCode = std::uint64_t;
constexpr UnitCode unit_code(RoundIndex round, TileIndex tile) { return UnitCode{round} << 32 | tile; }
constexpr RoundIndex round_of(UnitCode code) { return static_cast<RoundIndex>(code >> 32); }
constexpr TileIndex tile_of(UnitCode code) { return static_cast<TileIndex>(code); }

using WorkerIndex = std::uint32_t;
inline constexpr WorkerIndex kNoWorker = ~WorkerIndex{0};

class UnitTable {
 public:
  struct Result {
    // All zero: unknown, because the unit was found in the stored image after a restart, but no record of its
    // result was found
    Digest digest;
    WorkerIndex worker = kNoWorker;
  };

  explicit UnitTable(TileIndex tiles) : tiles_(tiles), issued_(tiles), folded_(tiles) {}

  TileIndex tiles() const { return tiles_; }

  // Accepted results
  const Result* find(UnitCode code) const;  // null: the unit has no accepted result
  bool accepted(UnitCode code) const { return find(code) != nullptr; }
  void accept(UnitCode code, const Result& result);  // requires that the unit has no accepted result yet
  std::uint64_t accepted_count() const { return accepted_count_; }
  // One past the tile's last round that has an accepted result
  RoundIndex end_of_accepted(TileIndex tile) const;
  // Forgets the tile's accepted results of rounds from `end` on; none of these may be in the image
  void truncate(TileIndex tile, RoundIndex end);
  // Forgets round `round` of all tiles, whether accepted or in the image, so that it can be rendered again.
  // Requires that no later round has results
  void reopen(RoundIndex round);
  // Forgets all results of the tile, also those in the image. Returns the units that had an accepted result,
  // ascending.
  std::vector<UnitCode> void_tile(TileIndex tile);
  // Returns the tiles with an accepted result of this worker, ascending
  std::vector<TileIndex> tiles_of(WorkerIndex worker) const;
  void mark_workers(std::vector<bool>& used) const;  // sets used[worker] for the workers of accepted results
  // Frees the memory of results and errors but keeps the numbers of folded rounds; for a job that failed or
  // was cancelled
  void forget_results();

  // Folding

  // Returns the tile's next round to add to the image and counts it in issued(). nullopt: this round has no
  // accepted result, is greater than `limit`, or is not less than `end`.
  std::optional<RoundIndex> issue_fold(TileIndex tile, RoundIndex limit, RoundIndex end);
  // Number of rounds whose addition to the image was requested
  RoundIndex issued(TileIndex tile) const { return issued_[tile]; }
  // Notes that the tile's round is in the image. `rel_error_sum`: relative squared error after this round,
  // summed over the tile's pixels and channels. If the round is not the next of the tile's requested rounds,
  // returns false and changes nothing.
  bool fold(TileIndex tile, RoundIndex round, double rel_error_sum);
  void restore_folded(TileIndex tile, RoundIndex rounds);
  void restore_error(RoundIndex round, TileIndex tile, double rel_error_sum);
  RoundIndex folded(TileIndex tile) const { return folded_[tile]; }
  std::uint64_t folded_count() const { return folded_count_; }
  // Number of rounds, from round 0 on, that are in the image for every tile
  RoundIndex rounds_complete() const { return rounds_complete_; }
  // Returns the tile's sum of relative squared errors after this round, as passed to fold(); NaN: unknown
  double error(RoundIndex round, TileIndex tile) const;

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
