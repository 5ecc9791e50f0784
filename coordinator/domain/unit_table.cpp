#include "coordinator/domain/unit_table.h"

#include <algorithm>
#include <limits>

#include "core/base/check.h"

namespace ls::coordinator {

UnitTable::Round& UnitTable::round(RoundIndex index) {
  if (index >= rounds_.size()) rounds_.resize(index + 1);
  return rounds_[index];
}

const UnitTable::Result* UnitTable::find(UnitCode code) const {
  const RoundIndex r = round_of(code);
  if (r >= rounds_.size() || rounds_[r].results.empty()) return nullptr;
  const Result& result = rounds_[r].results[tile_of(code)];
  return result.worker == kNoWorker ? nullptr : &result;
}

void UnitTable::accept(UnitCode code, const Result& result) {
  CHECK(!accepted(code) && result.worker != kNoWorker, "unit {:#x} accepted twice", code);
  Round& r = round(round_of(code));
  if (r.results.empty()) r.results.resize(tiles_);
  r.results[tile_of(code)] = result;
  ++r.accepted;
  ++accepted_count_;
}

RoundIndex UnitTable::end_of_accepted(TileIndex tile) const {
  for (std::size_t k = rounds_.size(); k-- > 0;)
    if (accepted(unit_code(static_cast<RoundIndex>(k), tile))) return static_cast<RoundIndex>(k + 1);
  return 0;
}

void UnitTable::truncate(TileIndex tile, RoundIndex end) {
  for (RoundIndex k = end; k < rounds_.size(); ++k) {
    Round& r = rounds_[k];
    if (r.results.empty() || r.results[tile].worker == kNoWorker) continue;
    CHECK(issued_[tile] <= k, "tile {} round {} is cut off though its fold was asked for", tile, k);
    r.results[tile] = {};
    --accepted_count_;
    if (--r.accepted == 0) r.results = {};
  }
}

void UnitTable::reopen(RoundIndex index) {
  // Rounds after `index` may still be listed, but have no results: they were discarded when earlier rounds
  // became the tiles' last ones.
  while (rounds_.size() > index + 1 && rounds_.back().accepted == 0 && rounds_.back().folded == 0)
    rounds_.pop_back();
  if (index >= rounds_.size()) return;
  CHECK(index + 1 == rounds_.size(), "round {} is reopened though {} rounds are known", index,
        rounds_.size());
  accepted_count_ -= rounds_[index].accepted;
  folded_count_ -= rounds_[index].folded;
  rounds_.pop_back();
  for (TileIndex t = 0; t < tiles_; ++t) {
    issued_[t] = std::min(issued_[t], index);
    folded_[t] = std::min(folded_[t], index);
  }
  rounds_complete_ = std::min(rounds_complete_, index);
}

std::vector<UnitCode> UnitTable::void_tile(TileIndex tile) {
  std::vector<UnitCode> voided;
  for (RoundIndex k = 0; k < rounds_.size(); ++k) {
    Round& r = rounds_[k];
    if (!r.errors.empty()) r.errors[tile] = std::numeric_limits<double>::quiet_NaN();
    if (k < folded_[tile]) --r.folded, --folded_count_;
    if (r.results.empty() || r.results[tile].worker == kNoWorker) continue;
    voided.push_back(unit_code(k, tile));
    r.results[tile] = {};
    --accepted_count_;
    if (--r.accepted == 0) r.results = {};
  }
  issued_[tile] = folded_[tile] = 0;
  rounds_complete_ = 0;
  settle_complete();
  return voided;
}

void UnitTable::mark_workers(std::vector<bool>& used) const {
  for (const Round& round : rounds_)
    for (const Result& result : round.results)
      if (result.worker != kNoWorker) used[result.worker] = true;
}

std::vector<TileIndex> UnitTable::tiles_of(WorkerIndex worker) const {
  std::vector<bool> has(tiles_);
  for (const Round& r : rounds_)
    for (TileIndex t = 0; t < r.results.size(); ++t)
      if (r.results[t].worker == worker) has[t] = true;
  std::vector<TileIndex> found;
  for (TileIndex t = 0; t < tiles_; ++t)
    if (has[t]) found.push_back(t);
  return found;
}

void UnitTable::forget_results() {
  for (Round& r : rounds_) r.results = {}, r.errors = {};
}

std::optional<RoundIndex> UnitTable::issue_fold(TileIndex tile, RoundIndex limit, RoundIndex end) {
  const RoundIndex next = issued_[tile];
  if (next > limit || next >= end || !accepted(unit_code(next, tile))) return std::nullopt;
  ++issued_[tile];
  return next;
}

bool UnitTable::fold(TileIndex tile, RoundIndex index, double rel_error_sum) {
  if (tile >= tiles_ || folded_[tile] != index || index >= issued_[tile]) return false;
  restore_error(index, tile, rel_error_sum);
  ++folded_[tile];
  ++folded_count_;
  ++rounds_[index].folded;
  settle_complete();
  return true;
}

void UnitTable::restore_folded(TileIndex tile, RoundIndex rounds) {
  for (RoundIndex k = folded_[tile]; k < rounds; ++k) ++round(k).folded, ++folded_count_;
  folded_[tile] = issued_[tile] = std::max(folded_[tile], rounds);
  settle_complete();
}

void UnitTable::restore_error(RoundIndex index, TileIndex tile, double rel_error_sum) {
  Round& r = round(index);
  if (r.errors.empty()) r.errors.assign(tiles_, std::numeric_limits<double>::quiet_NaN());
  r.errors[tile] = rel_error_sum;
}

double UnitTable::error(RoundIndex index, TileIndex tile) const {
  if (index >= rounds_.size() || rounds_[index].errors.empty())
    return std::numeric_limits<double>::quiet_NaN();
  return rounds_[index].errors[tile];
}

void UnitTable::settle_complete() {
  while (rounds_complete_ < rounds_.size() && rounds_[rounds_complete_].folded == tiles_) ++rounds_complete_;
}

}  // namespace ls::coordinator
