#include "coordinator/domain/worker_table.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/base/parse_number.h"

namespace ls::coordinator {

WorkerIndex WorkerTable::index_of(const WorkerId& id) {
  const auto known = index_.find(id);
  if (known != index_.end()) return known->second;
  WorkerIndex index = static_cast<WorkerIndex>(ids_.size());
  if (free_.empty()) {
    ids_.push_back(id);
  } else {
    index = free_.back();
    free_.pop_back();
    ids_[index] = id;
  }
  index_.emplace(id, index);
  return index;
}

void WorkerTable::keep_names(std::vector<bool> used) {
  for (const auto& [index, worker] : workers_) used[index] = true;
  for (WorkerIndex i = 0; i < ids_.size(); ++i) {
    if (used[i] || ids_[i].empty()) continue;
    index_.erase(ids_[i]);
    principals_.erase(i);
    ids_[i] = {};
    free_.push_back(i);
  }
  kept_ = index_.size();
}

Worker& WorkerTable::get(const WorkerId& id) {
  const WorkerIndex index = index_of(id);
  auto& worker = workers_[index];
  if (!worker) {
    worker = std::make_unique<Worker>();
    worker->index = index;
    worker->id = id;
  }
  return *worker;
}

Worker* WorkerTable::find(const WorkerId& id) {
  const auto it = index_.find(id);
  if (it == index_.end()) return nullptr;
  const auto known = workers_.find(it->second);
  return known == workers_.end() ? nullptr : known->second.get();
}

const Worker* WorkerTable::find(const WorkerId& id) const { return const_cast<WorkerTable*>(this)->find(id); }

void WorkerTable::forget(Worker& worker) {
  wanting_work_.erase(worker.index);
  workers_.erase(worker.index);
}

void WorkerTable::settle(Worker& worker) {
  if (worker.available() && worker.wants_more())
    wanting_work_.insert(worker.index);
  else
    wanting_work_.erase(worker.index);
}

void WorkerTable::connected(Worker& worker, bool yes) {
  if (worker.connected == yes) return;
  worker.connected = yes;
  threads_ += yes ? worker.threads : -worker.threads;
  connected_ += yes ? 1 : -1;
  cores_ = connected_ > 0 ? cores_ + (yes ? worker.cores() : -worker.cores()) : 0;
  if (worker.quarantined) return;
  count(worker, yes);
}

void WorkerTable::count(const Worker& worker, bool yes) {
  Count& c = classes_[worker.numeric_class];
  c.workers += yes ? 1 : -1;
  c.threads += yes ? worker.threads : -worker.threads;
  if (c.workers == 0) classes_.erase(worker.numeric_class);
}

void WorkerTable::measured(Worker& worker, double cpu_seconds, double wait_seconds) {
  const double before = worker.cores();
  worker.core_share.measured(cpu_seconds, wait_seconds);
  if (worker.connected) cores_ += worker.cores() - before;
}

void WorkerTable::quarantine(Worker& worker) {
  if (!std::exchange(worker.quarantined, true) && worker.connected) count(worker, false);
}

WorkerTable::Count WorkerTable::of_class(const Digest& numeric_class) const {
  const auto found = classes_.find(numeric_class);
  return found == classes_.end() ? Count{} : found->second;
}

WorkerTable::Count WorkerTable::of_all_classes() const {
  Count all;
  for (const auto& [numeric_class, c] : classes_) {
    all.workers += c.workers;
    all.threads += c.threads;
  }
  return all;
}

std::uint64_t head_of(const Digest& digest) {
  std::uint64_t head = 0;
  std::memcpy(&head, digest.bytes.data(), sizeof head);
  return head;
}

bool holds(const Job& job, const Worker& worker) {
  return worker.warmed_up.contains(job.seq) ||
         std::binary_search(worker.blobs.begin(), worker.blobs.end(), head_of(job.plan.brief.scene));
}

bool of_class_asked(const Job& job, const Worker& worker) {
  const std::string& asked = job.plan.class_asked;
  return worker.platform.starts_with(asked) || worker.numeric_class.hex().starts_with(asked);
}

bool fits(const Job& job, const Worker& worker) {
  if (worker.quarantined) return false;
  if (worker.memory_bytes != 0 && job.plan.memory_bytes > worker.memory_bytes) return false;
  if (job.numeric_class ? *job.numeric_class != worker.numeric_class : !worker.may_begin) return false;
  if (!of_class_asked(job, worker)) return false;
  return std::includes(worker.tags.begin(), worker.tags.end(), job.plan.tags.begin(), job.plan.tags.end());
}

bool may_serve(const Job& job, const Worker& worker, TimePoint now) {
  const FruitlessLeases* fruitless = worker.fruitless_in(job.seq);
  return worker.available() && fits(job, worker) && !worker.blocked(job.seq, now) &&
         !(fruitless && now < fruitless->until);
}

void FruitlessLeases::add(TimePoint now, std::string why) {
  // The first time, the worker waits until the next tick (Pause::returned) only
  if (count > 0)
    until = now + std::min(kFruitlessPause * (1 << std::min(count - 1, 16u)), kFruitlessPauseMost);
  ++count;
  reason = std::move(why);
}

void LeaseTable::add(LeaseRecord record) {
  deadlines_.emplace(record.deadline, record.seq);
  leases_.emplace(record.seq, std::move(record));
}

std::optional<std::uint64_t> lease_number(const LeaseId& id, std::string_view prefix) {
  const std::string_view text = id.value;
  if (!text.starts_with(prefix) || !text.substr(prefix.size()).starts_with('-')) return std::nullopt;
  return parse_number<std::uint64_t>(text.substr(prefix.size() + 1));
}

LeaseRecord* LeaseTable::find(LeaseSeq seq) {
  const auto it = leases_.find(seq);
  return it == leases_.end() ? nullptr : &it->second;
}

LeaseRecord* LeaseTable::find(const LeaseId& id) {
  const auto seq = lease_number(id, prefix_);
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
