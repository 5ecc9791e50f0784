// Remembers workers that once held a lease on a unit (one round of one tile) but did not deliver its accepted
// result. If results of a unit differ, only these workers may vote on it (farm_trust.cpp). The table is
// bounded: beyond kMaxVoters the entries of the earliest rounds are dropped, and later results of those units
// are mere claims, not votes.
#pragma once

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "coordinator/domain/limits.h"
#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

class VoterTable {
 public:
  void note(UnitCode unit, WorkerIndex worker) {
    held_.emplace(unit, worker);
    if (held_.size() > kMaxVoters) held_.erase(held_.begin());
  }
  bool has(UnitCode unit, WorkerIndex worker) const { return held_.contains({unit, worker}); }
  void clear() { held_.clear(); }
  std::size_t size() const { return held_.size(); }
  void mark_workers(std::vector<bool>& used) const {
    for (const auto& [unit, worker] : held_) used[worker] = true;
  }

 private:
  std::set<std::pair<UnitCode, WorkerIndex>> held_;
};

}  // namespace ls::coordinator
