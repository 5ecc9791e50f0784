// The workers that are known: who is there, what they hold, how they have behaved.
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

// Why a connected worker gets nothing for the moment.
enum class Pause {
  none,
  silent,   // a deadline passed without a word; until it reports
  stuck,    // it reports, but finishes nothing; until it does, or is idle
  returned  // it gave a lease back; until the next tick
};

struct Worker {
  WorkerIndex index = kNoWorker;
  WorkerId id;
  std::string name;
  std::uint64_t epoch = 0;
  Digest numeric_class;
  int threads = 1;
  std::vector<std::string> tags;     // sorted
  std::uint64_t memory_bytes = 0;    // 0: not told
  std::vector<std::uint64_t> blobs;  // first bytes of what it said it holds, sorted
  bool barred = false;               // it rendered wrong pixels
  bool connected = false;
  bool draining = false;
  Pause pause = Pause::none;
  std::optional<TimePoint> sick_since;
  TimePoint lost_at{};
  TimePoint grown_at{};  // last time it finished something, or began after having had nothing

  std::set<LeaseSeq> leases;
  std::uint32_t units_out = 0;
  double seconds_out = 0;  // predicted CPU seconds of units_out
  std::uint64_t units_done = 0;
  CoreShare core_share;
  std::set<JobSeq> briefed;    // jobs this stream has had the brief of
  std::set<JobSeq> warmed_up;  // jobs it has finished a unit of on this stream: the world is loaded
  std::map<JobSeq, WorkerFailures> failures;

  // That its threads have together: in a second of the clock it renders so many CPU seconds.
  double cores() const { return threads * core_share.get(); }
  double seconds_until_free() const { return seconds_out / cores(); }
  bool covered() const { return units_out >= static_cast<std::uint32_t>(threads); }
  bool blocked(JobSeq job, TimePoint now) const {
    const auto it = failures.find(job);
    return it != failures.end() && it->second.blocked_at(now);
  }
  // Two units a thread at least, and three leases or what lasts three leases' time.
  bool wants_more() const {
    if (leases.size() >= kMaxLeasesPerWorker) return false;
    if (units_out < kUnitsAThread * static_cast<std::uint32_t>(threads)) return true;
    return leases.size() < kLeasesPerWorker && seconds_until_free() < kLeasesPerWorker * kLeaseSeconds;
  }
  bool available() const { return connected && !draining && pause == Pause::none && !sick_since && !barred; }
  WorkerState state() const {
    if (!connected) return WorkerState::lost;
    if (draining) return WorkerState::draining;
    return sick_since || barred ? WorkerState::sick : WorkerState::connected;
  }
};

class WorkerBook {
 public:
  // The worker of this id, made when unknown. Indices stay a worker's own over its absences.
  Worker& get(const WorkerId& id);
  Worker* find(const WorkerId& id);
  const Worker* find(const WorkerId& id) const;
  const WorkerId& name_of(WorkerIndex index) const { return ids_[index]; }
  WorkerIndex index_of(const WorkerId& id);  // for workers that are only named in a record
  void forget(Worker& worker);
  // Names outlive their workers, since results name them; of preemptible workers there come new ones every
  // hour.
  bool has_many_names() const { return index_.size() > 2 * kept_ + kNamesKept; }
  std::size_t names() const { return index_.size(); }
  // Forgets all names but those of known workers and of indices that are true here. Their indices are given
  // to others.
  void keep_names(std::vector<bool> used);
  std::vector<bool> no_index() const { return std::vector<bool>(ids_.size()); }

  // Brings the list of those that want work up to date; call it after any change to a worker.
  void settle(Worker& worker);
  const std::set<WorkerIndex>& hungry() const { return hungry_; }
  Worker& at(WorkerIndex index) { return *workers_.at(index); }

  const std::map<WorkerIndex, std::unique_ptr<Worker>>& all() const { return workers_; }
  int threads() const { return threads_; }  // of connected workers
  double cores() const { return cores_; }   // theirs, to rounding: threads, by the core that each gets
  int connected() const { return connected_; }
  void connected(Worker& worker, bool yes);
  void measured(Worker& worker, double cpu_seconds, double wait_seconds);  // core_share.h
  void bar(Worker& worker);
  std::uint32_t of_class(const Digest& numeric_class) const;  // connected ones that are not barred

 private:
  std::vector<WorkerId> ids_;
  std::unordered_map<WorkerId, WorkerIndex> index_;
  std::vector<WorkerIndex> free_;
  std::size_t kept_ = 0;  // names at the last keep_names()
  std::map<WorkerIndex, std::unique_ptr<Worker>> workers_;
  std::set<WorkerIndex> hungry_;
  int threads_ = 0, connected_ = 0;
  double cores_ = 0;
  std::map<Digest, std::uint32_t> classes_;
};

// The first bytes of a digest, as Worker::blobs keeps them.
std::uint64_t head_of(const Digest& digest);
// Has the job's world, or at least its files.
bool holds(const Job& job, const Worker& worker);

// Of the job's numeric class, with its tags, with memory enough, and trusted; leaves aside what the worker is
// doing.
bool fits(const Job& job, const Worker& worker);
// And may take units of it now.
bool may_serve(const Job& job, const Worker& worker, TimePoint now);

}  // namespace ls::coordinator
