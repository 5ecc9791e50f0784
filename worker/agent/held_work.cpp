#include "worker/agent/held_work.h"

#include <algorithm>
#include <utility>

namespace ls::worker {
namespace {
constexpr std::size_t kEntryOverhead = 256;  // approximate size of an outbox entry without its result
}  // namespace

void HeldLeases::add(const Lease& lease, const std::function<bool(const UnitKey&)>& handed_in,
                     const std::optional<trace::SpanContext>& trace, std::int64_t unix_ns) {
  for (const LeaseUnit& unit : lease.units) {
    const UnitKey key{lease.job, unit.tile, unit.round};
    auto [it, is_new] = units_.try_emplace(key);
    Entry& entry = it->second;
    if (!is_new) leave(entry.held.lease, false);
    ++leases_[lease.id].open;
    entry.held.lease = lease.id;
    entry.held.trace = trace;
    if (!is_new) continue;
    entry.held.key = key;
    entry.held.unit = unit;
    entry.held.since_unix_ns = unix_ns;
    entry.held.state = handed_in(key) ? State::handed_in : State::waiting;
    if (entry.held.state == State::waiting) enqueue(entry);
  }
}

std::optional<HeldLeases::Held> HeldLeases::take(const std::function<bool(const JobId&)>& ready,
                                                 const JobId* before) {
  for (auto it = queue_.begin(); it != queue_.end(); ++it) {
    if (before && it->second.job == *before) return std::nullopt;
    if (!ready(it->second.job)) continue;
    Entry& entry = units_.at(it->second);
    queue_.erase(it);
    entry.held.state = State::running;
    ++running_;
    return entry.held;
  }
  return std::nullopt;
}

std::optional<LeaseId> HeldLeases::finish(const UnitKey& key) {
  const auto it = units_.find(key);
  if (it == units_.end() || it->second.held.state != State::running) return std::nullopt;
  const LeaseId lease = it->second.held.lease;
  --running_;
  units_.erase(it);
  leave(lease, true);
  return lease;
}

void HeldLeases::acknowledged(const UnitKey& key, bool refused) {
  const auto it = units_.find(key);
  if (it == units_.end() || it->second.held.state != State::handed_in) return;
  if (refused) {
    it->second.held.state = State::waiting;
    enqueue(it->second);
    return;
  }
  const LeaseId lease = it->second.held.lease;
  units_.erase(it);
  leave(lease, true);
}

void HeldLeases::drop_job(const JobId& job) {
  drop_if([&](const Held& held) { return held.key.job == job; });
}

void HeldLeases::drop_lease(const LeaseId& lease) {
  drop_if([&](const Held& held) { return held.lease == lease; });
}

std::vector<LeaseReturned> HeldLeases::return_waiting() {
  return return_if({}, [](const Held&) { return true; });
}

std::vector<LeaseReturned> HeldLeases::return_waiting(const JobId& job, const std::string& reason) {
  return return_if(reason, [&](const Held& held) { return held.key.job == job; });
}

std::vector<LeaseReturned> HeldLeases::return_waiting(const LeaseId& lease) {
  return return_if({}, [&](const Held& held) { return held.lease == lease; });
}

std::vector<LeaseReturned> HeldLeases::return_if(const std::string& reason,
                                                 const std::function<bool(const Held&)>& goes) {
  std::map<LeaseId, LeaseReturned> returned;
  for (auto it = queue_.begin(); it != queue_.end();) {
    const Held& held = units_.at(it->second).held;
    if (!goes(held)) {
      ++it;
      continue;
    }
    const LeaseId lease = held.lease;
    returned[lease].lease = lease;
    returned[lease].reason = reason;
    returned[lease].unrendered.push_back(it->second);
    units_.erase(it->second);
    leave(lease, false);
    it = queue_.erase(it);
  }
  std::vector<LeaseReturned> out;
  for (auto& [id, r] : returned) out.push_back(std::move(r));
  return out;
}

std::optional<HeldLeases::Held> HeldLeases::first_waiting(const JobId& job) const {
  for (const auto& [order, key] : queue_)
    if (key.job == job) return units_.at(key).held;
  return std::nullopt;
}

const HeldLeases::Held* HeldLeases::find(const UnitKey& key) const {
  const auto it = units_.find(key);
  return it == units_.end() ? nullptr : &it->second.held;
}

bool HeldLeases::is_running(const UnitKey& key) const {
  const Held* held = find(key);
  return held && held->state == State::running;
}

bool HeldLeases::holds(const JobId& job) const {
  const auto it = units_.lower_bound(UnitKey{job, 0, 0});
  return it != units_.end() && it->first.job == job;
}

bool HeldLeases::needs_before(const JobId& job, const JobId& other) const {
  for (auto it = units_.lower_bound(UnitKey{job, 0, 0}); it != units_.end() && it->first.job == job; ++it)
    if (it->second.held.state == State::running) return true;
  for (const auto& [order, key] : queue_) {
    if (key.job == job) return true;
    if (key.job == other) return false;
  }
  return false;
}

std::vector<JobId> HeldLeases::wanted() const {
  std::vector<JobId> jobs;
  for (const auto& [order, key] : queue_)
    if (std::find(jobs.begin(), jobs.end(), key.job) == jobs.end()) jobs.push_back(key.job);
  return jobs;
}

std::vector<WorkerProgress::Entry> HeldLeases::progress() const {
  std::vector<WorkerProgress::Entry> entries;
  for (const auto& [id, lease] : leases_) entries.push_back({id, lease.done});
  return entries;
}

void HeldLeases::enqueue(Entry& entry) {
  entry.order = next_order_++;
  queue_.emplace(entry.order, entry.held.key);
}

void HeldLeases::leave(const LeaseId& lease, bool done) {
  const auto it = leases_.find(lease);
  if (it == leases_.end()) return;
  if (done) ++it->second.done;
  if (--it->second.open == 0) leases_.erase(it);
}

void HeldLeases::drop_if(const std::function<bool(const Held&)>& goes) {
  for (auto it = units_.begin(); it != units_.end();) {
    const Entry& entry = it->second;
    if (!goes(entry.held)) {
      ++it;
      continue;
    }
    if (entry.held.state == State::waiting) queue_.erase(entry.order);
    if (entry.held.state == State::running) --running_;
    leave(entry.held.lease, false);
    it = units_.erase(it);
  }
}

void Outbox::add(UnitResult result) {
  const std::size_t bytes = result.exr.size() + kEntryOverhead;
  entries_.push_back({result.unit, std::move(result), bytes});
  bytes_ += bytes;
}

void Outbox::add(UnitFailure failure) {
  const std::size_t bytes = failure.reason.size() + kEntryOverhead;
  entries_.push_back({failure.unit, std::move(failure), bytes});
  bytes_ += bytes;
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
    return true;
  });
}

std::vector<FromWorker> Outbox::take_unsent() {
  std::vector<FromWorker> out;
  for (Entry& entry : entries_)
    if (!std::exchange(entry.sent, true)) out.push_back(entry.message);
  return out;
}

void Outbox::connection_lost() {
  for (Entry& entry : entries_) entry.sent = false;
}

bool Outbox::has_result(const UnitKey& unit) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.unit == unit && std::holds_alternative<UnitResult>(e.message);
  });
}

}  // namespace ls::worker
