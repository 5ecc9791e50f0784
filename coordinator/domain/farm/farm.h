// The farm: a state machine that decides which worker renders which units, what is folded when, and when a
// job ends. A function of events and time: no I/O, no threads, no clock, no log. Not thread-safe; the service
// guards it with one mutex.
//
// effects = farm.handle(event, now); `now` never goes back.
//
// The path of a result: worker -> the service calls wanted(unit), verifies the partial and makes it durable
// -> UnitAccepted -> {RecordUnit, Fold...} -> the assembler folds -> UnitFolded -> {Checkpoint,
// JobFinished...}. Several results of one unit may be under way at once: the first UnitAccepted wins.
//
// The cost of handle() does not grow with the number of tiles or units, except once per round (checkpoint)
// and per job.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "coordinator/domain/effect.h"
#include "coordinator/domain/event.h"
#include "coordinator/domain/figures.h"

namespace ls::coordinator {

// Rejects plans beyond limits.h: too many units, no tile, a target error or time that is not positive.
Result<void> check_plan(const JobPlan& plan);

// What the service should do with a result that has arrived
struct Wanted {
  enum class Verdict {
    yes,        // verify it against `samples` and `numeric_class`, then raise UnitAccepted
    duplicate,  // the same; equal digests are dropped, unequal ones are evidence against a worker
    no          // acknowledge and drop
  };
  Verdict verdict = Verdict::no;
  SampleRange samples;  // the range needed of this unit now
  PixelRect rect;
  // The class that the job is pinned to; nullopt: any, the first result pins it
  std::optional<Digest> numeric_class;
  std::string why;  // reason, with `no`
};

struct JobFigures {
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;
  std::uint64_t spp = 0;           // requested, or the limit
  std::uint64_t units_total = 0;   // planned, as far as known: reaching a target reduces it
  std::uint64_t units_done = 0;    // accepted
  std::uint64_t units_leased = 0;  // distinct units
  std::uint64_t units_queued = 0;  // total = done + leased + queued
  std::uint64_t units_folded = 0;
  RoundIndex rounds_complete = 0;  // rounds folded in all tiles
  int priority = 0;
  // Predicted CPU time of the units not done, from measured cost; 0: nothing measured yet, or the end of an
  // adaptive job is not predicted yet.
  double core_seconds_left = 0;
  double core_seconds_to_limit = 0;  // the same up to the sample limit, regardless of the error
  double cores = 0;  // of the workers that hold its leases, each by the job's fraction of the worker's leases
  double core_seconds_queued = 0;  // predicted for units not leased
  double seconds_per_sample = 0;   // mean CPU seconds per pixel sample; 0: nothing measured yet
  std::optional<TimePoint> first_ray;
  std::optional<Digest> numeric_class;
};

struct WorkerFigures {
  WorkerState state = WorkerState::connected;
  int threads = 1;
  std::uint32_t leases = 0;
  std::uint32_t units_out = 0;
  std::uint64_t units_done = 0;
  JobId job;  // the job of its oldest lease; may be empty
};

struct TileFigures {
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
};

class Farm {
 public:
  struct Options {
    std::string lease_prefix = "l";  // leases are named PREFIX-1, PREFIX-2...; must differ for every start
    ShareLimits limits = {};
    double audit_rate = 0;         // fraction of the accepted results that another worker renders again
    std::uint64_t audit_seed = 0;  // chooses them; must be unknown to workers
  };

  Farm();
  explicit Farm(Options options);
  ~Farm();
  Farm(Farm&&) noexcept;
  Farm& operator=(Farm&&) noexcept;

  std::vector<Effect> handle(const Event& event, TimePoint now);

  // Queries. For an unknown id they return nullopt, an empty container or Verdict::no.
  Wanted wanted(const UnitKey& unit) const;
  std::vector<JobId> jobs() const;  // in order of submission
  std::optional<JobFigures> job(const JobId& id) const;
  // The plan to store: with changed priority and spp, without a target or time limit that no longer applies.
  std::optional<JobPlan> plan(const JobId& id) const;
  // Error: why JobRetargeted or JobExtended would change nothing.
  Result<void> may_retarget(const JobId& id, double target_error) const;
  Result<void> may_extend(const JobId& id, std::uint64_t spp) const;
  std::vector<WorkerId> workers() const;
  std::optional<WorkerFigures> worker(const WorkerId& id) const;
  std::optional<TileFigures> tile(const JobId& id, TileIndex tile) const;
  std::vector<WorkerId> tile_workers(const JobId& id, TileIndex tile) const;  // scans the leases
  // Why a job that could run has no worker: names workers of another class, without its tags, blocked or
  // unhealthy. Empty if some worker may take it.
  std::string why_waiting(const JobId& id) const;
  // Core seconds of all users with jobs at work, as FairShare counts them; for tests and metrics.
  struct Shares {
    std::string owner;
    int priority = 0;
    double seconds = 0;
  };
  std::vector<Shares> shares() const;
  AuditFigures audits() const;
  // Open audits, to be stored: otherwise a restart would clear a faulty worker.
  std::vector<JobRestored::Audit> open_audits(const JobId& id) const;
  std::vector<JobId> take_changed_audits();  // jobs whose open audits may have changed since the last call
  bool quarantined(const WorkerId& worker) const;
  // True if a job without a numeric class may be pinned to this worker's class.
  bool may_pin(const JobId& id, const WorkerId& worker) const;
  double cores_connected() const;  // over connected workers: threads times core share
  int workers_connected() const;

  // Sizes of all containers, by name; for tests that look for unbounded growth.
  std::vector<std::pair<std::string, std::size_t>> sizes() const;

  // Checks all invariants and describes the first violation: planned = done + leased + queued; leases,
  // workers and jobs agree with one another; no worker is idle while a unit it may take is queued. Empty if
  // all hold. Slow: for tests and occasional checks in service; only right after handle().
  std::string audit() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ls::coordinator
