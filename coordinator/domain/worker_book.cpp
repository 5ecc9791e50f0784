#include "coordinator/domain/worker_book.h"

#include <algorithm>

namespace ls::coordinator {

WorkerIndex WorkerBook::index_of(const WorkerId& id) {
  const auto [it, made] = index_.try_emplace(id, static_cast<WorkerIndex>(ids_.size()));
  if (made) ids_.push_back(id);
  return it->second;
}

Worker& WorkerBook::get(const WorkerId& id) {
  const WorkerIndex index = index_of(id);
  auto& worker = workers_[index];
  if (!worker) {
    worker = std::make_unique<Worker>();
    worker->index = index;
    worker->id = id;
  }
  return *worker;
}

Worker* WorkerBook::find(const WorkerId& id) {
  const auto it = index_.find(id);
  if (it == index_.end()) return nullptr;
  const auto known = workers_.find(it->second);
  return known == workers_.end() ? nullptr : known->second.get();
}

const Worker* WorkerBook::find(const WorkerId& id) const { return const_cast<WorkerBook*>(this)->find(id); }

void WorkerBook::forget(Worker& worker) {
  hungry_.erase(worker.index);
  workers_.erase(worker.index);
}

void WorkerBook::settle(Worker& worker) {
  if (worker.available() && worker.wants_more())
    hungry_.insert(worker.index);
  else
    hungry_.erase(worker.index);
}

void WorkerBook::connected(Worker& worker, bool yes) {
  if (worker.connected == yes) return;
  worker.connected = yes;
  threads_ += yes ? worker.threads : -worker.threads;
  connected_ += yes ? 1 : -1;
}

bool fits(const Job& job, const Worker& worker) {
  if (job.numeric_class && *job.numeric_class != worker.numeric_class) return false;
  return std::includes(worker.tags.begin(), worker.tags.end(), job.plan.tags.begin(), job.plan.tags.end());
}

bool may_serve(const Job& job, const Worker& worker, TimePoint now) {
  return worker.available() && fits(job, worker) && !worker.blocked(job.seq, now);
}

}  // namespace ls::coordinator
