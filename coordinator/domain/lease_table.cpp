#include "coordinator/domain/lease_table.h"

#include "common/base/parse_number.h"

namespace ls::coordinator {

LeaseRecord& LeaseTable::add(LeaseRecord record) {
  deadlines_.emplace(record.deadline, record.seq);
  const LeaseSeq seq = record.seq;
  return leases_.emplace(seq, std::move(record)).first->second;
}

LeaseRecord* LeaseTable::find(LeaseSeq seq) {
  const auto it = leases_.find(seq);
  return it == leases_.end() ? nullptr : &it->second;
}

LeaseRecord* LeaseTable::find(const LeaseId& id) {
  const std::string_view text = id.value;
  const std::size_t head = prefix_.size() + 1;
  if (text.size() <= head || !text.starts_with(prefix_) || text[head - 1] != '-') return nullptr;
  const auto seq = parse_number<LeaseSeq>(text.substr(head));
  return seq ? find(*seq) : nullptr;
}

void LeaseTable::erase(LeaseSeq seq) {
  const auto it = leases_.find(seq);
  if (it == leases_.end()) return;
  deadlines_.erase({it->second.deadline, seq});
  leases_.erase(it);
}

void LeaseTable::renew(LeaseRecord& lease, TimePoint deadline) {
  deadlines_.erase({lease.deadline, lease.seq});
  lease.deadline = deadline;
  deadlines_.emplace(deadline, lease.seq);
}

LeaseRecord* LeaseTable::expired(TimePoint now) {
  if (deadlines_.empty() || deadlines_.begin()->first > now) return nullptr;
  return find(deadlines_.begin()->second);
}

}  // namespace ls::coordinator
