// All leases, oldest first, with their deadlines.
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
  // Including finished ones; those still leased have this lease in their Holders
  std::vector<UnitCode> units;
  std::uint32_t remaining = 0;
  std::uint32_t reported = 0;   // units done, from the worker's progress reports
  double seconds_per_unit = 0;  // predicted CPU seconds, mean over its units
  double charge_per_unit = 0;   // seconds_per_unit, or kAssumedUnitSeconds if nothing is measured
  bool audit = false;           // renders one accepted unit again
  TimePoint issued{};
  Duration predicted{};  // from `issued` until the last unit is done, including the worker's earlier leases
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
  // The lease with the earliest deadline if that has passed, else null.
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
