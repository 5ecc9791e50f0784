// All leases, oldest first, with their deadlines. A lease is a list of units (rounds of tiles) that is
// assigned to one worker.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "coordinator/domain/worker_table.h"

namespace ls::coordinator {

struct LeaseRecord {
  LeaseSeq seq = 0;
  Job* job = nullptr;
  Worker* worker = nullptr;
  // All units of the lease, finished ones included. A unit is still leased if its Holders (job.h) name this
  // lease
  std::vector<UnitCode> units;
  std::uint32_t remaining = 0;  // number of units still leased
  std::uint32_t reported = 0;   // number of units done, from the worker's progress reports
  double seconds_per_unit = 0;  // predicted CPU seconds of a unit, mean over all units of the lease
  // Core seconds per unit charged to the owner's share: seconds_per_unit, or kAssumedUnitSeconds if nothing
  // is measured
  double charge_per_unit = 0;
  // An audit: a lease of one unit that has an accepted result and is rendered again for comparison
  bool audit = false;
  TimePoint issued{};
  // Predicted time from `issued` until its last unit is done, including the wait for the worker's earlier
  // leases
  Duration predicted{};
  TimePoint deadline{};
};

class LeaseTable {
 public:
  explicit LeaseTable(std::string prefix) : prefix_(std::move(prefix)) {}

  LeaseSeq next_seq() { return ++last_; }
  LeaseRecord& add(LeaseRecord record);
  LeaseRecord* find(LeaseSeq seq);
  LeaseRecord* find(const LeaseId& id);
  void erase(LeaseSeq seq);
  void renew(LeaseRecord& lease, TimePoint deadline);
  // Returns the lease with the earliest deadline if this deadline has passed at `now`, else null.
  LeaseRecord* expired(TimePoint now);

  std::map<LeaseSeq, LeaseRecord>& all() { return leases_; }
  const std::map<LeaseSeq, LeaseRecord>& all() const { return leases_; }
  LeaseId id_of(LeaseSeq seq) const { return {prefix_ + "-" + std::to_string(seq)}; }

 private:
  std::string prefix_;
  LeaseSeq last_ = 0;
  std::map<LeaseSeq, LeaseRecord> leases_;
  std::set<std::pair<TimePoint, LeaseSeq>> deadlines_;
};

}  // namespace ls::coordinator
