// All known workers: their connection, leases and failures.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <unordered_map>
#include <vector>

#include "coordinator/domain/core_share.h"
#include "coordinator/domain/event.h"
#include "coordinator/domain/failure_budget.h"
#include "coordinator/domain/job.h"

namespace ls::coordinator {

// Why a connected worker gets no work at the moment
enum class Pause {
  none,
  silent,   // a deadline passed without a message; until it reports
  stuck,    // it reports but finishes nothing; until it finishes a unit or is idle
  returned  // it returned a lease; until the next tick
};

struct Worker {
  WorkerIndex index = kNoWorker;
  WorkerId id;
  std::string name;
  std::uint64_t epoch = 0;
  Digest numeric_class;
  int threads = 1;
  std::vector<std::string> tags;     // sorted
  std::uint64_t memory_bytes = 0;    // 0: unknown
  std::vector<std::uint64_t> blobs;  // first bytes of the digests that it reports to hold, sorted
  bool quarantined = false;          // it rendered wrong pixels
  bool connected = false;
  bool draining = false;
  Pause pause = Pause::none;
  std::optional<TimePoint> unhealthy_since;
  TimePoint lost_at{};
  TimePoint progress_at{};  // when it last finished something, or began after being idle

  std::set<LeaseSeq> leases;
  std::uint32_t units_out = 0;
  double seconds_out = 0;  // predicted CPU seconds of its leased units
  std::uint64_t units_done = 0;
  CoreShare core_share;
  std::set<JobSeq> briefed;    // jobs whose brief was sent on this stream
  std::set<JobSeq> warmed_up;  // jobs of which it has finished a unit on this stream: the world is loaded
  std::map<JobSeq, WorkerFailures> failures;

  // Cores that its threads get together: CPU seconds rendered per second of wall-clock time.
  double cores() const { return threads * core_share.get(); }
  double seconds_until_free() const { return seconds_out / cores(); }
  bool saturated() const { return units_out >= static_cast<std::uint32_t>(threads); }
  bool blocked(JobSeq job, TimePoint now) const {
    const auto it = failures.find(job);
    return it != failures.end() && it->second.blocked_at(now);
  }
  // Wants at least two units per thread; beyond that, up to three leases, or the work of three full ones.
  bool wants_more() const {
    if (leases.size() >= kMaxLeasesPerWorker) return false;
    if (units_out < kUnitsAThread * static_cast<std::uint32_t>(threads)) return true;
    return leases.size() < kQueuedLeases && seconds_until_free() < kQueuedLeases * kLeaseSeconds;
  }
  bool available() const {
    return connected && !draining && pause == Pause::none && !unhealthy_since && !quarantined;
  }
  WorkerState state() const {
    if (!connected) return WorkerState::lost;
    if (draining) return WorkerState::draining;
    return unhealthy_since || quarantined ? WorkerState::unhealthy : WorkerState::connected;
  }
};

class WorkerTable {
 public:
  // Returns the worker of this id, creating it if unknown. A worker keeps its index over its absences.
  Worker& get(const WorkerId& id);
  Worker* find(const WorkerId& id);
  const Worker* find(const WorkerId& id) const;
  const WorkerId& name_of(WorkerIndex index) const { return ids_[index]; }
  WorkerIndex index_of(const WorkerId& id);  // for workers that only a record names
  void forget(Worker& worker);
  // Names outlive their workers, since results refer to them; preemptible workers bring new names every hour.
  bool has_many_names() const { return index_.size() > 2 * kept_ + kNamesKept; }
  std::size_t names() const { return index_.size(); }
  // Forgets all names except those of known workers and of indices marked in `used`, and reuses their
  // indices.
  void keep_names(std::vector<bool> used);
  std::vector<bool> no_index() const { return std::vector<bool>(ids_.size()); }

  // Updates wanting_work(); call it after any change to a worker.
  void settle(Worker& worker);
  const std::set<WorkerIndex>& wanting_work() const { return wanting_work_; }
  Worker& at(WorkerIndex index) { return *workers_.at(index); }

  const std::map<WorkerIndex, std::unique_ptr<Worker>>& all() const { return workers_; }
  int threads() const { return threads_; }  // of all connected workers
  // Cores of all connected workers (threads times core share), up to rounding
  double cores() const { return cores_; }
  int connected() const { return connected_; }
  void connected(Worker& worker, bool yes);
  // Updates its core share (core_share.h)
  void measured(Worker& worker, double cpu_seconds, double wait_seconds);
  void quarantine(Worker& worker);
  // Connected workers of the class that are not quarantined
  std::uint32_t of_class(const Digest& numeric_class) const;

 private:
  std::vector<WorkerId> ids_;
  std::unordered_map<WorkerId, WorkerIndex> index_;
  std::vector<WorkerIndex> free_;
  std::size_t kept_ = 0;  // names left by the last keep_names()
  std::map<WorkerIndex, std::unique_ptr<Worker>> workers_;
  std::set<WorkerIndex> wanting_work_;
  int threads_ = 0, connected_ = 0;
  double cores_ = 0;
  std::map<Digest, std::uint32_t> classes_;
};

// The first bytes of a digest, as in Worker::blobs
std::uint64_t head_of(const Digest& digest);
// True if the worker has the job's world, or at least its files.
bool holds(const Job& job, const Worker& worker);

// True if the worker has the job's numeric class and tags, enough memory, and is not quarantined. Ignores
// what the worker is doing.
bool fits(const Job& job, const Worker& worker);
// True if it also may take units of the job now.
bool may_serve(const Job& job, const Worker& worker, TimePoint now);

}  // namespace ls::coordinator
