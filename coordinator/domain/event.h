// Events: the farm's inputs. Every fact on which a decision depends arrives as an event; the farm reads no
// clock and no file. Terms: docs/reference/glossary.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "coordinator/domain/job_state.h"
#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/id.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"
#include "util/protocol/messages.h"

namespace ls::coordinator {

// The settings of a job, with the scene's defaults filled in.
struct JobPlan {
  JobBrief brief;
  TileGrid grid;
  std::optional<std::uint64_t> spp;    // samples per pixel; nullopt: at most kMaxSppWithoutLimit (limits.h)
  std::optional<double> target_error;  // the job ends when the image has this relMSE
  bool target_denoised = false;        // true: target_error applies to the denoised layers, not the image
  std::optional<double> time;          // the job ends this many seconds after the first ray, pauses excluded
  int priority = 0;                    // jobs of a higher priority go first
  std::vector<std::string> tags;       // only a worker that has all these tags gets units of the job
  // Command that renders a sample of the job again, still without the pixel and the number of the sample.
  // replay_command() (core/job/health_notes.h) adds these.
  std::string replay = "lightshaft render SCENE";
  // Limits and fair shares (fair_share.h, docs/design/scheduling.md)
  std::string owner;  // the user (JobView::owner); empty: the administrator, to whom no user limits apply
  // The sequence (a job with frames) that this job is a frame of; empty: none. The frames of a sequence share
  // the limits below.
  std::string group;
  // Limits of the job; if it has a group, all jobs of the group share them
  std::uint32_t max_workers = 0;   // at most this many workers hold units at the same time; 0: no limit
  std::uint32_t max_units = 0;     // at most this many units are leased at the same time; 0: no limit
  std::uint64_t memory_bytes = 0;  // memory that a worker needs for this job; 0: unknown
  // The numeric class that the user requests: the beginning of its hexadecimal digits, or of the name of its
  // platform. Empty: any class
  std::string class_asked;
  // A rectangle of the frame: the tiles that it touches are leased before all others; nullopt: no tile goes
  // first. It changes only the order in which units are leased, not the image.
  std::optional<PixelRect> focus;
  bool held = false;  // true: no unit is leased, as the job waits for other jobs to end
};

// Jobs
struct JobSubmitted {
  JobPlan plan;
};

// Adds a stored job to the farm again, for example after a restart. This event must come before any other
// event of the job.
struct JobRestored {
  struct Unit {
    TileIndex tile = 0;
    RoundIndex round = 0;
    // The sample range of the result. The farm ignores the result if the job now needs another range of this
    // unit: the job's old sample count had truncated the round, and the job was extended since.
    SampleRange samples;
    Digest digest;
    WorkerId worker;
  };
  JobPlan plan;
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;    // set for a job that is done
  std::optional<Digest> numeric_class;  // class of the workers that rendered its results; nullopt: none
  std::vector<Unit> accepted;           // accepted results that still exist, in any order
  // For each tile, how many rounds the restored image has. A last round that the job's sample count truncates
  // is included. Empty: no image was restored. Required for a job that is done.
  std::vector<RoundIndex> folded;
  // rel_error[round][tile] is UnitFolded::rel_error_sum of that round of the tile, for each round in the
  // image. Only for a job with a target error
  std::vector<std::vector<double>> rel_error;
  double elapsed_seconds = 0;  // seconds from the first ray until the restart; 0: no ray yet
  // An audit that had not ended at the restart (Farm::open_audits). In an audit another worker renders the
  // unit of an accepted result again, for comparison.
  struct Audit {
    TileIndex tile = 0;
    RoundIndex round = 0;
    std::optional<std::pair<WorkerId, Digest>> second;  // a second result that differs from the accepted one
    bool operator==(const Audit&) const = default;
  };
  std::vector<Audit> audits;
  // If the target error applies to the denoised layers: the checks of their error so far
  std::vector<DenoisedCheck> denoised_checks;
};

struct JobCancelled {
  JobId job;
};
struct JobPaused {
  JobId job;
};
struct JobResumed {
  JobId job;
};
// The user has stopped the job. Units that were leased before, and the first round of every tile, are still
// rendered; then the job ends as `done`.
struct JobStopped {
  JobId job;
};
struct JobPriority {
  JobId job;
  int priority = 0;
};
// Changes JobPlan::held. Units that are leased already are rendered.
struct JobHeld {
  JobId job;
  bool held = false;
};
// Changes JobPlan::focus. A focus must lie in the frame; otherwise the event is ignored.
struct JobFocused {
  JobId job;
  std::optional<PixelRect> focus;
};
// Changes the target error of a job. The job must have a target error; if it has stopped, the reason must be
// that it reached this error (Farm::may_retarget). A smaller target resumes such a job. The image then has
// the same bits as with the smaller target from the start: wherever it missed the larger target, it would
// also have missed the smaller one. A larger target applies from the job's current state on.
struct JobRetargeted {
  JobId job;
  double target_error = 0;  // relMSE
};
// Raises the job's total of samples per pixel; the job may be running, paused or done. If the last round of
// every tile is already fixed, because the job has ended or is about to end, the job loses its target error,
// and all tiles get the new total. The job also loses a time limit that has passed.
struct JobExtended {
  JobId job;
  std::uint64_t spp = 0;
};
// Makes the farm forget a job that has ended. Later only the event JobRestored may add a job with the same
// id.
struct JobForgotten {
  JobId job;
};

// Workers

// A worker has opened a stream (a connection to the coordinator). `epoch` rises from stream to stream; an
// older stream of the worker counts as lost.
struct WorkerJoined {
  WorkerId worker;
  std::uint64_t epoch = 0;
  std::string name;
  Digest numeric_class;
  int threads = 1;
  std::vector<std::string> tags;
  // Memory that the worker's renderer may use, in bytes; 0: unknown, and the worker may get units of any job
  std::uint64_t memory_bytes = 0;
  std::vector<Digest> blobs_held;  // scene files in its cache, most recently used first
  // False: the worker gets no units of jobs that have no numeric class yet, only of jobs that are pinned to
  // its class. It is false for workers of another version than the coordinator's.
  bool may_begin = true;
  std::string platform = {};  // the machine and build of its numeric class, in words
  // Who answers for the worker: its certificate or its address, as far as the coordinator can tell. All
  // workers of one principal have one vote. Empty: the worker is a principal of its own.
  std::string principal = {};
  // Memory for briefs that it offers (BriefMemory in util/protocol/briefs.h), in bytes; 0: each lease needs
  // its brief
  std::uint64_t brief_bytes = 0;
};
// The worker rendered wrong pixels; this was found before a restart or by another coordinator. It gets no
// work, and its results for jobs of this farm are void.
struct WorkerQuarantined {
  WorkerId worker;
  std::string why;
};
// The worker's stream has closed. The event is ignored unless `epoch` is that of the worker's latest stream.
struct WorkerLost {
  WorkerId worker;
  std::uint64_t epoch = 0;
};
// The worker wants no more units or, if `withdrawn`, wants units again. `restarts`: after its last unit it
// restarts its program, which joins as a new worker.
struct WorkerDrains {
  WorkerId worker;
  bool withdrawn = false, restarts = false;
};
// The farm names leases "PREFIX-1", "PREFIX-2"... Returns the number in `id`; nullopt if `id` has another
// prefix, which an earlier start of the coordinator used.
std::optional<std::uint64_t> lease_number(const LeaseId& id, std::string_view prefix);

struct LeaseProgress {
  WorkerId worker;
  std::vector<WorkerProgress::Entry> leases;
};
// A result of this worker has arrived, but the coordinator has no room for it yet. The result waits, and so
// do all later messages of the worker. The wait is not the worker's fault, so its leases are renewed.
struct ResultsWait {
  WorkerId worker;
};
struct LeaseCameBack {
  WorkerId worker;
  LeaseReturned returned;
  // True: the worker has rendered these units, but the coordinator could not keep the results. That does not
  // tell against the worker
  bool not_kept = false;
};

// Units

// A verified result of this numeric class is about to be made durable. If the job has no class yet, it is
// pinned to this one: from now on only workers of this class may render it. So the job's stored results are
// all of one class.
struct ClassChosen {
  JobId job;
  Digest numeric_class;
};
// A result has been verified and made durable. The event is raised for every result that arrives; the farm
// detects duplicates.
struct UnitAccepted {
  UnitKey unit;
  SampleRange samples;
  Digest digest;
  WorkerId worker;
  double cpu_seconds = 0;
  // Seconds that the rendering thread waited for a core or for memory while it rendered the unit; CoreShare
  // (worker_table.h) uses them
  double wait_seconds = 0;
};
// The result of a unit has been added to the image, as the effect Fold (effect.h) requested.
struct UnitFolded {
  UnitKey unit;
  SampleRange samples;  // the same as in the Fold effect
  // The tile's relative squared error after all rounds up to this one, summed over pixels and channels:
  // TileError::relative.squares (core/image/error/error_estimate.h).
  double rel_error_sum = 0;
};
// The error of the denoised layers has been computed, as the effect CheckDenoised (effect.h) requested, at
// one level of the stop rule (adaptive_stop.h). The service has already stored the result with the job.
struct DenoisedChecked {
  JobId job;
  DenoisedCheck check;
};
// A worker has failed to render a unit. Either the worker has reported it, or its result has failed
// verification.
struct UnitFailed {
  WorkerId worker;
  UnitFailure failure;
};

// Raised about once a second. It lets the farm notice lease deadlines, overdue units, failures that are to be
// forgiven, and time limits.
struct Tick {};

using Event =
    std::variant<JobSubmitted, JobRestored, JobCancelled, JobPaused, JobResumed, JobStopped, JobPriority,
                 JobHeld, JobFocused, JobRetargeted, JobExtended, JobForgotten, WorkerJoined,
                 WorkerQuarantined, WorkerLost, WorkerDrains, LeaseProgress, ResultsWait, LeaseCameBack,
                 ClassChosen, UnitAccepted, UnitFolded, DenoisedChecked, UnitFailed, Tick>;

}  // namespace ls::coordinator
