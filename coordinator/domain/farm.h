// The farm: one state machine that decides who renders what, what is folded when, and when a job ends. A
// function of events and time: no I/O, no threads, no clock, no log. Not thread-safe; the service holds one
// mutex around it.
//
//   effects = farm.handle(event, now)      now never goes back
//
// A result's way: worker -> service asks wanted(unit) -> verifies the partial, makes it durable ->
// UnitAccepted -> {RecordUnit, Fold...} -> the assembler folds -> UnitFolded -> {Checkpoint, JobFinished...}.
// Several results of one unit may be under way at once: the first UnitAccepted wins.
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

// Refuses plans beyond limits.h: too many units, no tile, a target or time that is not positive.
Result<void> check_plan(const JobPlan& plan);

// What is to be done with a result that has come in.
struct Wanted {
  enum class Verdict {
    yes,        // verify it against `samples` and `numeric_class`, then raise UnitAccepted
    duplicate,  // verify and raise UnitAccepted too: equal digests are dropped, unequal ones are evidence
    no          // acknowledge and drop
  };
  Verdict verdict = Verdict::no;
  SampleRange samples;  // the range that is wanted of this unit now
  PixelRect rect;
  std::optional<Digest> numeric_class;  // that the job is pinned to; nothing: any, it will be the first
  std::string why;                      // with `no`
};

struct JobFigures {
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;
  std::uint64_t spp = 0;           // asked, or the limit
  std::uint64_t units_total = 0;   // planned, as far as known: a reached target shrinks it
  std::uint64_t units_done = 0;    // accepted
  std::uint64_t units_leased = 0;  // distinct units out at workers
  std::uint64_t units_queued = 0;  // total = done + leased + queued
  std::uint64_t units_folded = 0;
  RoundIndex rounds_complete = 0;  // folded over all tiles
  int priority = 0;
  // Predicted for what is not done, from measured cost; 0: nothing measured yet, or not foreseen when its
  // target is reached.
  double core_seconds_left = 0;
  double core_seconds_to_limit = 0;  // the same until all samples are there, whatever the error
  double cores = 0;                  // of the workers that hold leases of it, by its share of their leases
  double core_seconds_queued = 0;    // of those, predicted for units that no worker has
  double seconds_per_sample = 0;     // mean CPU seconds per pixel sample; 0: nothing measured yet
  std::optional<TimePoint> first_ray;
  std::optional<Digest> numeric_class;
};

struct WorkerFigures {
  WorkerState state = WorkerState::connected;
  int threads = 1;
  std::uint32_t leases = 0;
  std::uint32_t units_out = 0;
  std::uint64_t units_done = 0;
  JobId job;  // of its oldest lease; may be empty
};

struct TileFigures {
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
};

class Farm {
 public:
  struct Options {
    std::string lease_prefix = "l";  // leases are named PREFIX-1, PREFIX-2...; another one for every start
    ShareLimits limits = {};
    double audit_rate = 0;         // share of the accepted results that another worker renders again
    std::uint64_t audit_seed = 0;  // chooses them; workers must not know it
  };

  Farm();
  explicit Farm(Options options);
  ~Farm();
  Farm(Farm&&) noexcept;
  Farm& operator=(Farm&&) noexcept;

  std::vector<Effect> handle(const Event& event, TimePoint now);

  // ---- queries: nothing (or Verdict::no) for an unknown id ----
  Wanted wanted(const UnitKey& unit) const;
  std::vector<JobId> jobs() const;  // in order of submission
  std::optional<JobFigures> job(const JobId& id) const;
  // As it stands: priority and spp as changed, a target or time that no longer applies left out. To be
  // stored.
  std::optional<JobPlan> plan(const JobId& id) const;
  // Why JobRetargeted or JobExtended would change nothing.
  Result<void> may_retarget(const JobId& id, double target_error) const;
  Result<void> may_extend(const JobId& id, std::uint64_t spp) const;
  std::vector<WorkerId> workers() const;
  std::optional<WorkerFigures> worker(const WorkerId& id) const;
  std::optional<TileFigures> tile(const JobId& id, TileIndex tile) const;
  std::vector<WorkerId> tile_workers(const JobId& id, TileIndex tile) const;  // scans the leases
  // Why a job that could run has no worker: names workers of another class, without its tags, blocked or
  // sick. Empty while someone may take it.
  std::string why_waiting(const JobId& id) const;
  // Core seconds of all users and jobs at work, as their turns are counted; for tests and metrics.
  struct Shares {
    std::string owner;
    int priority = 0;
    double seconds = 0;
  };
  std::vector<Shares> shares() const;
  AuditFigures audits() const;
  // Results that are being rendered again: to be stored, or a restart would let off who is wrong.
  std::vector<JobRestored::Audit> open_audits(const JobId& id) const;
  std::vector<JobId> take_changed_audits();  // jobs whose open audits may be others than at the last call
  bool barred(const WorkerId& worker) const;
  // Whether a job that has no numeric class yet may get this worker's.
  bool may_pin(const JobId& id, const WorkerId& worker) const;
  double cores_connected() const;  // of connected workers: threads, by the core that each gets
  int workers_connected() const;

  // How much there is of everything that it keeps; for tests: what grows without an end?
  std::vector<std::pair<std::string, std::size_t>> sizes() const;

  // Looks through everything and says what does not add up: planned = done + leased + queued, what leases,
  // workers and jobs say of one another, no worker idle while a unit it may take is queued. Empty if all is
  // well. Slow: for tests and for a rare look in service; only right after handle().
  std::string audit() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ls::coordinator
