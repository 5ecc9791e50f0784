// Who was lent a unit that another one's result came first of, or that was taken back from it: what such a
// worker still says of the unit it was asked for, so that its word counts where results differ
// (farm_trust.cpp). Bounded; of too many those of the earliest rounds are forgotten, and what is then said of
// them is a claim like any other.
#pragma once

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "coordinator/domain/limits.h"
#include "coordinator/domain/unit_table.h"

namespace ls::coordinator {

class WitnessBook {
 public:
  void note(UnitCode unit, WorkerIndex worker) {
    lent_.emplace(unit, worker);
    if (lent_.size() > kMaxWitnesses) lent_.erase(lent_.begin());
  }
  bool has(UnitCode unit, WorkerIndex worker) const { return lent_.contains({unit, worker}); }
  void clear() { lent_.clear(); }
  std::size_t size() const { return lent_.size(); }
  void mark_workers(std::vector<bool>& used) const {
    for (const auto& [unit, worker] : lent_) used[worker] = true;
  }

 private:
  std::set<std::pair<UnitCode, WorkerIndex>> lent_;
};

}  // namespace ls::coordinator
