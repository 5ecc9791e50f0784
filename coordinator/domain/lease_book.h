// Leases that are out, oldest first, with their deadlines.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "coordinator/domain/worker_book.h"

namespace ls::coordinator {

struct LeaseRecord {
  LeaseSeq seq = 0;
  Job* job = nullptr;
  Worker* worker = nullptr;
  std::vector<UnitCode> units;  // those still out are the ones whose Holders name this lease
  std::uint32_t remaining = 0;
  std::uint32_t reported = 0;   // units done, as its progress said
  double seconds_per_unit = 0;  // predicted CPU seconds, mean over its units
  double charge_per_unit = 0;   // the same, or an assumption where nothing is measured
  bool audit = false;           // of one unit that has been accepted
  TimePoint issued{};
  Duration predicted{};  // from issued until all of it is done, the worker's earlier leases included
  TimePoint deadline{};
};

class LeaseBook {
 public:
  explicit LeaseBook(std::string prefix) : prefix_(std::move(prefix)) {}

  LeaseSeq next_seq() { return ++last_; }
  LeaseRecord& add(LeaseRecord record);
  LeaseRecord* find(LeaseSeq seq);
  LeaseRecord* find(const LeaseId& id);
  void erase(LeaseSeq seq);
  void renew(LeaseRecord& lease, TimePoint deadline);
  // The lease whose deadline is the first to have passed, if any has.
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
