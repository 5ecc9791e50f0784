// All known workers, with their connections and failures, and all leases. Terms: docs/reference/glossary.md.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "coordinator/domain/event.h"
#include "coordinator/domain/job.h"
#include "coordinator/domain/limits.h"
#include "util/protocol/briefs.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {

// The share of a core that each thread of a worker gets: CPU seconds used / (CPU seconds used + seconds
// waited). Both are measured from the reports that come with the worker's results. The seconds waited are
// those that the thread waited for a core (because of other programs, a nice value, or more threads than
// cores) or for memory from the disk. Costs are CPU seconds (CostModel); this share converts them to
// wall-clock seconds. It affects the size of leases, their deadlines and predictions, never a pixel.
class CoreShare {
 public:
  // Adds the times of one result. A pair with an implausible value (negative, not finite, more than a day) is
  // ignored.
  void measured(double cpu_seconds, double wait_seconds) {
    const auto sane = [](double s) { return s >= 0 && s <= kMostUnitSeconds; };
    if (!sane(cpu_seconds) || !sane(wait_seconds)) return;
    cpu_ = cpu_ * kMemory + cpu_seconds;
    wall_ = wall_ * kMemory + cpu_seconds + wait_seconds;
  }
  // Returns the share, which is 1 until something has been measured. It is never less than kLeastCoreShare.
  double get() const { return wall_ > 0 ? std::max(kLeastCoreShare, cpu_ / wall_) : 1; }

 private:
  // Each new result multiplies the sums of earlier results by this factor, so that mainly the last hundred
  // results count
  static constexpr double kMemory = 1 - 1.0 / 64;
  double cpu_ = 0, wall_ = 0;
};

// Why a connected worker gets no work for a while
enum class Pause {
  none,
  silent,   // the deadline of a lease passed without a message from the worker; ends when it reports
  stuck,    // the worker reports but has finished no unit for long; ends when it finishes one or is idle
  returned  // the worker returned a lease; ends at the next tick
};

// The jobs whose worlds (scenes made ready to render) a worker has in memory: those of its latest results, as
// many as a worker keeps.
class LoadedWorlds {
 public:
  bool contains(JobSeq job) const { return std::find(jobs_.begin(), jobs_.end(), job) != jobs_.end(); }
  void insert(JobSeq job) {
    erase(job);
    jobs_.insert(jobs_.begin(), job);
    jobs_.resize(std::min(jobs_.size(), ls::limits::kWorldsKept));
  }
  void erase(JobSeq job) { std::erase(jobs_, job); }
  void clear() { jobs_.clear(); }
  std::size_t size() const { return jobs_.size(); }

 private:
  std::vector<JobSeq> jobs_;  // that of the latest result first
};

// Leases of one job that a worker has given back or has not finished in time, without a result in between.
// All that end between two ticks count as one.
struct FruitlessLeases {
  std::uint32_t count = 0;
  TimePoint tick{};    // the latest tick when the latest was counted
  TimePoint until{};   // the worker gets no units of the job before this time
  std::string reason;  // of the latest: why the worker gave it back, or that it did not finish it

  void add(TimePoint now, std::string why);
};

// How long a worker has had work, and what it says that it did with this time
struct WorkedTime {
  TimePoint since{};
  double claimed = 0;  // CPU seconds that were believed of its results (Farm::believable_seconds)
};

struct Worker {
  WorkerIndex index = kNoWorker;
  WorkerId id;
  std::string name;
  std::uint64_t epoch = 0;
  std::string principal;  // WorkerJoined::principal, or the worker's id
  Digest numeric_class;
  std::string platform;
  int threads = 1;
  std::vector<std::string> tags;   // tags that the worker has announced, sorted
  std::uint64_t memory_bytes = 0;  // memory that its renderer may use; 0: unknown
  // The blobs that the worker holds, according to its reports: the first 8 bytes of each digest (head_of()),
  // sorted
  std::vector<std::uint64_t> blobs;
  bool quarantined = false;  // it rendered wrong pixels
  bool may_begin = true;     // false: it gets no units of jobs without a numeric class
  bool connected = false;
  bool draining = false;
  bool restarts = false;  // when it has drained, it restarts its program
  Pause pause = Pause::none;
  std::optional<TimePoint> unhealthy_since;
  TimePoint lost_at{};
  TimePoint progress_at{};  // when it last finished a unit, or when it got its first unit after being idle
  WorkedTime worked;        // since it last got a unit after being idle
  // The previous value of `worked`; nullopt: the worker can no longer be rendering units of that time
  std::optional<WorkedTime> worked_before;
  bool interrupted = false;  // true if such leases were taken from it since worked.since

  std::set<LeaseSeq> leases;
  std::uint32_t units_out = 0;  // units leased to it
  double seconds_out = 0;       // predicted CPU seconds of its leased units
  std::uint64_t units_done = 0;
  CoreShare core_share;
  BriefMemory<JobSeq> briefs;  // the jobs whose settings (JobBrief) it remembers
  LoadedWorlds warmed_up;      // the jobs whose scenes it has loaded
  std::map<JobSeq, WorkerFailures> failures;
  // By job. A job has no entry once the worker has delivered a result of it
  std::map<JobSeq, FruitlessLeases> fruitless;
  // Fruitless leases of all jobs since its latest result
  std::uint32_t fruitless_in_a_row = 0;

  // Returns how many cores its threads get together: the CPU seconds that they use per second of wall-clock
  // time.
  double cores() const { return threads * core_share.get(); }
  double seconds_until_free() const { return seconds_out / cores(); }
  // True if it holds at least one unit for each of its threads.
  bool saturated() const { return units_out >= static_cast<std::uint32_t>(threads); }
  // True if it has delivered an accepted result since it joined this farm.
  bool proven() const { return units_done > 0; }
  bool blocked(JobSeq job, TimePoint now) const {
    const auto it = failures.find(job);
    return it != failures.end() && it->second.blocked_at(now);
  }
  // Its fruitless leases of this job; null: there are none, or a result has come since
  const FruitlessLeases* fruitless_in(JobSeq job) const {
    const auto it = fruitless.find(job);
    return it == fruitless.end() ? nullptr : &it->second;
  }
  // Begins a new `worked`: the worker was idle, or all its leases were taken from it, and it gets work now.
  void begin_work(TimePoint now) {
    if (!interrupted)
      worked_before.reset();
    else if (worked_before)
      worked_before->claimed += worked.claimed;
    else
      worked_before = worked;
    interrupted = false;
    worked = {now, 0};
  }
  // Returns the time in which the worker may have rendered a unit that it has held since then.
  const WorkedTime& worked_on(TimePoint unit_since) const {
    return worked_before && unit_since < worked.since ? *worked_before : worked;
  }
  // Notes that this cost of a unit was believed, which the worker has held since `unit_since`.
  void claim(TimePoint unit_since, double cpu_seconds, TimePoint now) {
    if (!worked_before || unit_since >= worked.since) {
      worked.claimed += cpu_seconds;
      return;
    }
    worked_before->claimed += cpu_seconds;
    // Only this part can lie in the present time
    worked.claimed += std::min(cpu_seconds, seconds(now - worked.since));
  }
  // True if nobody should wait for results of this job from this worker: too many leases were fruitless. It
  // is offered units of the job nevertheless, from time to time.
  bool unable(JobSeq job) const {
    const FruitlessLeases* of_job = fruitless_in(job);
    return fruitless_in_a_row >= kFruitlessLeases || (of_job && of_job->count >= kFruitlessLeases);
  }
  // True if the worker should get another lease. This is so if it holds fewer than kUnitsAThread units per
  // thread. It is also so if it holds fewer than kQueuedLeases leases and its leased work takes less time
  // than kQueuedLeases full leases (kLeaseSeconds each). In both cases it must hold fewer than
  // kMaxLeasesPerWorker leases.
  bool wants_more() const {
    if (leases.size() >= kMaxLeasesPerWorker) return false;
    if (units_out < kUnitsAThread * static_cast<std::uint32_t>(threads)) return true;
    return leases.size() < kQueuedLeases && seconds_until_free() < kQueuedLeases * kLeaseSeconds;
  }
  // True if nothing is known of it but that it was here
  bool never_worked() const {
    return units_done == 0 && failures.empty() && !unhealthy_since && !quarantined && leases.empty();
  }
  bool available() const {
    return connected && !draining && pause == Pause::none && !unhealthy_since && !quarantined;
  }
  WorkerState state() const {
    if (!connected) return WorkerState::lost;
    if (draining) return restarts ? WorkerState::restarting : WorkerState::draining;
    return unhealthy_since || quarantined ? WorkerState::unhealthy : WorkerState::connected;
  }
};

class WorkerTable {
 public:
  // Returns the worker with this id, and creates it if it is unknown. A worker that is lost and comes back
  // keeps its index.
  Worker& get(const WorkerId& id);
  Worker* find(const WorkerId& id);
  const Worker* find(const WorkerId& id) const;
  const WorkerId& name_of(WorkerIndex index) const { return ids_[index]; }
  // Returns the principal of the worker as it last joined; its id if it never did.
  const std::string& principal_of(WorkerIndex index) const {
    const auto known = principals_.find(index);
    return known == principals_.end() ? ids_[index].value : known->second;
  }
  void set_principal(Worker& worker, const std::string& principal) {
    worker.principal = principals_[worker.index] = principal.empty() ? worker.id.value : principal;
  }
  // Returns the index of the worker with this id; a new id gets an index. The id may come from a stored
  // record, and its worker may never have connected to this farm.
  WorkerIndex index_of(const WorkerId& id);
  void forget(Worker& worker);
  // True if it is time for keep_names(). Names accumulate: results refer to workers that are gone, and
  // preemptible workers bring new names every hour.
  bool has_many_names() const { return index_.size() > 2 * kept_ + kNamesKept; }
  std::size_t names() const { return index_.size(); }
  // Forgets all names except those of known workers and of indices marked in `used`. The indices of forgotten
  // names are given to new names.
  void keep_names(std::vector<bool> used);
  std::vector<bool> no_index() const { return std::vector<bool>(ids_.size()); }

  // Adds the worker to wanting_work() or removes it, depending on its state; call it after any change to a
  // worker.
  void settle(Worker& worker);
  const std::set<WorkerIndex>& wanting_work() const { return wanting_work_; }
  Worker& at(WorkerIndex index) { return *workers_.at(index); }

  const std::map<WorkerIndex, std::unique_ptr<Worker>>& all() const { return workers_; }
  int threads() const { return threads_; }  // number of threads of all connected workers
  // Returns the number of cores that the threads of all connected workers get together (Worker::cores()), up
  // to rounding errors
  double cores() const { return cores_; }
  int connected() const { return connected_; }
  void connected(Worker& worker, bool yes);
  // Adds a measurement to the worker's core share
  void measured(Worker& worker, double cpu_seconds, double wait_seconds);
  void quarantine(Worker& worker);
  // of_class() counts the workers of this numeric class, of_all_classes() those of all classes. Both count
  // only workers that are connected and not quarantined.
  struct Count {
    int workers = 0, threads = 0;
  };
  Count of_class(const Digest& numeric_class) const;
  Count of_all_classes() const;
  std::size_t classes() const { return classes_.size(); }  // number of classes of the workers that count

 private:
  std::vector<WorkerId> ids_;
  std::map<WorkerIndex, std::string> principals_;
  std::unordered_map<WorkerId, WorkerIndex> index_;
  std::vector<WorkerIndex> free_;
  std::size_t kept_ = 0;  // number of names that remained after the last keep_names()
  std::map<WorkerIndex, std::unique_ptr<Worker>> workers_;
  std::set<WorkerIndex> wanting_work_;
  int threads_ = 0, connected_ = 0;
  double cores_ = 0;
  void count(const Worker& worker, bool yes);
  std::map<Digest, Count> classes_;  // by numeric class; classes without workers have no entry
};

// Returns the first 8 bytes of a digest, as in Worker::blobs
std::uint64_t head_of(const Digest& digest);
// True if the worker has loaded the job's scene, or at least has reported that it holds the scene file.
bool holds(const Job& job, const Worker& worker);

// True if the user requests no numeric class for the job, or that of this worker (JobPlan::class_asked).
bool of_class_asked(const Job& job, const Worker& worker);
// True if the worker has the job's numeric class (if the job has none yet: if the worker may begin jobs), is
// of the class that the user requests, has the job's tags and enough memory, and is not quarantined. The
// worker may be busy or lost.
bool fits(const Job& job, const Worker& worker);
// True if the worker fits the job, can get work now (Worker::available()), is not blocked from the job by its
// failures, and is not to be left alone after fruitless leases of the job.
bool may_serve(const Job& job, const Worker& worker, TimePoint now);

struct LeaseRecord {
  LeaseSeq seq = 0;
  Job* job = nullptr;
  Worker* worker = nullptr;
  // All units of the lease, including finished ones and ones that were taken back. A unit is still leased if
  // its Holders (job.h) name this lease
  std::vector<UnitCode> units;
  std::uint32_t remaining = 0;  // number of units still leased
  std::uint32_t reported = 0;   // number of finished units, as the worker last reported
  double seconds_per_unit = 0;  // predicted CPU seconds of a unit, mean over all units of the lease
  // Core seconds per unit charged to the owner's share: seconds_per_unit, or kAssumedUnitSeconds if nothing
  // is measured
  double charge_per_unit = 0;
  // True for an audit: a lease of one unit that has an accepted result and is rendered again for comparison
  bool audit = false;
  bool with_brief = false;  // true if the job's brief was sent with it
  TimePoint issued{};
  // When the worker began to render the lease, as far as the coordinator can tell: its scene is loaded, and
  // the units of earlier leases no longer occupy all threads. nullopt: not yet
  std::optional<TimePoint> begun;
  // When the worker was asked to give back the units that it has not begun; nullopt: it was not asked
  std::optional<TimePoint> recalled;
  // True while units are expected to come back: until then the worker gets no further units of the job, which
  // would be of later rounds
  bool comes_back = false;
  // When its worker last finished a unit of this lease or of an earlier one; before that, `issued`
  TimePoint progress_at{};
  // Predicted time from `issued` until the last unit of this lease is done, including the wait for the
  // worker's earlier leases
  Duration predicted{};
  TimePoint deadline{};
};

// All leases, oldest first, with their deadlines.
class LeaseTable {
 public:
  explicit LeaseTable(std::string prefix) : prefix_(std::move(prefix)) {}

  LeaseSeq next_seq() { return ++last_; }
  void add(LeaseRecord record);
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
