// The farm is a state machine. It decides which worker renders which units, which results are folded (added
// to the job's image) and when, and when a job ends. Its effects depend only on events and time: it does no
// I/O and has no threads, no clock, no log. It is not thread-safe; the service guards it with one mutex.
// Terms: docs/reference/glossary.md.
//
// Usage: effects = farm.handle(event, now). `now` must not decrease from call to call.
//
// The path of a result: a worker sends it -> the service calls wanted(), verifies the partial (the encoded
// pixel sums of the unit) and makes it durable -> UnitAccepted -> {RecordUnit, Fold...} -> the assembler
// folds -> UnitFolded -> {Checkpoint, JobFinished...}. Several results of one unit may be under way at once:
// the first UnitAccepted wins.
//
// The cost of one call of handle() does not depend on the number of tiles or units, except when a round
// completes (checkpoint) and for events that come once per job.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/domain/effect.h"
#include "coordinator/domain/event.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/job_clock.h"
#include "core/base/error.h"

namespace ls::coordinator {

// Checks a plan. invalid_argument: it has no job id, no pixels, too many units (limits.h), a target error or
// time that is not positive, a time that is too long, or a focus outside the frame.
Result<void> check_plan(const JobPlan& plan);

// Returns a text that names a numeric class for people, such as "3f2a9c11d0e4
// (armv8-a:gcc-14.2.0:embree-4.3.3)".
std::string class_in_words(const Digest& numeric_class, const std::string& platform);

// How the service should handle a result that has arrived
struct Wanted {
  enum class Verdict {
    yes,          // verify it against `samples`, make it durable, then raise UnitAccepted
    duplicate,    // its unit has an accepted result already: verify it and raise UnitAccepted, since the farm
                  // compares the two, but do not store it
    other_class,  // its numeric class is not that of the job
    no            // not needed: acknowledge it to the worker and drop it
  };
  Verdict verdict = Verdict::no;
  SampleRange samples;  // the sample range that the job needs of this unit now
  PixelRect rect;
  // True if only workers of one numeric class may render the job for good, since a result of it was accepted
  bool pinned = false;
};

struct JobFigures {
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;
  std::uint64_t spp = 0;           // requested samples per pixel, or kMaxSppWithoutLimit (limits.h)
  std::uint64_t units_total = 0;   // units planned so far; the number falls when a target error is reached
  std::uint64_t units_done = 0;    // units with an accepted result
  std::uint64_t units_leased = 0;  // units leased to workers, each counted once even if a copy is leased, too
  std::uint64_t units_queued = 0;  // units that wait for a worker: units_total - units_done - units_leased
  std::uint64_t units_folded = 0;
  RoundIndex rounds_complete = 0;  // number of rounds that the image has of every tile
  // Predicted CPU seconds of the units that are not done, from measured cost. 0: nothing has been measured
  // yet, or the end of an adaptive job (one with a target error) is not predicted yet.
  double core_seconds_left = 0;
  double core_seconds_to_limit = 0;  // predicted CPU seconds left if all tiles get all their samples
  // Number of cores that work for the job. A worker that also holds leases of other jobs counts in part: its
  // cores times the number of its leases of this job, divided by the number of all its leases.
  double cores = 0;
  double core_seconds_queued = 0;  // predicted CPU seconds of the units that wait for a worker
  JobClock clock;
  std::optional<Digest> numeric_class;
  std::optional<ClassShare> class_share;  // nullopt: the job has no numeric class yet
};

struct WorkerFigures {
  WorkerState state = WorkerState::connected;
  int threads = 1;
  std::uint32_t leases = 0;
  std::uint32_t units_out = 0;
  std::uint64_t units_done = 0;
  JobId job;  // the job of its oldest lease; empty: it holds no lease
};

class Farm {
 public:
  struct Options {
    // Leases are named PREFIX-1, PREFIX-2...; each start of the coordinator needs another prefix
    std::string lease_prefix = "l";
    ShareLimits limits = {};
    double audit_rate = 0;  // fraction, 0 to 1, of accepted results that are rendered again to check them
    std::uint64_t audit_seed = 0;  // decides which results are audited; must be secret from workers
  };

  Farm();
  explicit Farm(Options options);
  ~Farm();
  Farm(Farm&&) noexcept;
  Farm& operator=(Farm&&) noexcept;

  std::vector<Effect> handle(const Event& event, TimePoint now);

  // Queries. For an unknown id they return nullopt, an empty container or Verdict::no. wanted() concerns a
  // result of `unit` that has arrived; `numeric_class` is that of the worker that rendered it.
  Wanted wanted(const UnitKey& unit, const Digest& numeric_class) const;
  std::optional<JobFigures> job(const JobId& id) const;
  // Returns the job's current plan, for storage. It has the priority and the number of samples that users
  // have set since the submission, and lacks a target error or time limit that no longer applies.
  std::optional<JobPlan> plan(const JobId& id) const;
  // Return the plan that the job would have after the event JobRetargeted or JobExtended with this target
  // error or number of samples, or the reason for which the farm would ignore the event.
  Result<JobPlan> retargeted(const JobId& id, double target_error) const;
  Result<JobPlan> extended(const JobId& id, std::uint64_t spp, TimePoint now) const;
  std::optional<WorkerFigures> worker(const WorkerId& id) const;
  // Returns how many of the CPU seconds that a worker reports for its result of this unit, which arrived at
  // `at`, are credible: one thread renders a unit, and not before the unit was leased to the worker; and the
  // results of a worker together cannot have taken more than all of its threads since it got work. A worker
  // whose stream broke, or which was silent, may have rendered its units all the time: for these, both count
  // from the first lease on. A result of a unit that was not leased to the worker is believed to have taken
  // what such units take.
  double believable_seconds(const UnitKey& unit, const WorkerId& worker, double reported, TimePoint at) const;
  // Explains to the user why a job that is queued or running stands still: each connected worker is of
  // another class, lacks memory or a tag, is blocked or unhealthy, gives the job's units back, or the like;
  // or one worker after the other was lost with them. Empty if some worker renders units of the job or may
  // take some, or if the job is in another state.
  std::string why_waiting(const JobId& id) const;
  AuditFigures audits() const;
  // Returns the job's open audits (units that are rendered again for comparison). The service must store
  // them: otherwise a faulty worker would no longer be suspected after a restart.
  std::vector<JobRestored::Audit> open_audits(const JobId& id) const;
  std::vector<JobId> take_changed_audits();  // jobs whose open audits may have changed since the last call
  bool quarantined(const WorkerId& worker) const;
  // True if a failure of this unit on this worker would count, and tells something new: the worker holds the
  // unit, and has not failed so often that it gets no more units of the job.
  bool failure_is_new(const WorkerId& worker, const UnitKey& unit) const;
  // True if the job has a numeric class already, or may be pinned to that of this worker (then only workers
  // of this class render it).
  bool may_pin(const JobId& id, const WorkerId& worker) const;
  double cores_connected() const;  // sum over connected workers of threads times core share (CoreShare)
  int workers_connected() const;

 private:
  friend struct FarmInspector;  // tests/unit/domain/farm_inspector.cpp
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ls::coordinator
