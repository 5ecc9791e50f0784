#include "worker/agent/result_outbox.h"

#include <algorithm>
#include <utility>

namespace ls::worker {
namespace {
constexpr std::size_t kEntryOverhead = 256;  // approximate memory of an entry besides its bytes
}

void Outbox::add(UnitResult result) {
  const std::size_t bytes = result.exr.size() + kEntryOverhead;
  const UnitKey unit = result.unit;
  entries_.push_back({unit, std::move(result), bytes, false});
  bytes_ += bytes;
  ++unsent_;
}

void Outbox::add(UnitFailure failure) {
  const std::size_t bytes = failure.reason.size() + kEntryOverhead;
  const UnitKey unit = failure.unit;
  entries_.push_back({unit, std::move(failure), bytes, false});
  bytes_ += bytes;
  ++unsent_;
}

bool Outbox::acknowledge(const UnitKey& unit) {
  const auto it = std::find_if(entries_.begin(), entries_.end(),
                               [&](const Entry& e) { return e.sent && e.unit == unit; });
  if (it == entries_.end()) return false;
  bytes_ -= it->bytes;
  entries_.erase(it);
  return true;
}

void Outbox::drop_job(const JobId& job) {
  std::erase_if(entries_, [&](const Entry& entry) {
    if (entry.unit.job != job) return false;
    bytes_ -= entry.bytes;
    if (!entry.sent) --unsent_;
    return true;
  });
}

std::vector<FromWorker> Outbox::take_unsent() {
  std::vector<FromWorker> out;
  if (unsent_ == 0) return out;
  for (Entry& entry : entries_) {
    if (entry.sent) continue;
    out.push_back(entry.message);
    entry.sent = true;
  }
  unsent_ = 0;
  return out;
}

void Outbox::connection_lost() {
  for (Entry& entry : entries_) entry.sent = false;
  unsent_ = entries_.size();
}

bool Outbox::has_result(const UnitKey& unit) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.unit == unit && std::holds_alternative<UnitResult>(e.message);
  });
}

}  // namespace ls::worker
