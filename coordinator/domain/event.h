// What the farm is told. Every fact that decides anything arrives here; the farm reads no clock and no file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/id.h"
#include "common/image/frame.h"
#include "common/image/rounds.h"
#include "common/protocol/messages.h"
#include "coordinator/domain/job_state.h"

namespace ls::coordinator {

// What a job asks for, resolved: the scene's own defaults are already in it.
struct JobPlan {
  JobBrief brief;
  TileGrid grid;
  std::optional<std::uint64_t> spp;                // nothing: limits.h kMaxSppWithoutLimit
  std::optional<double> target_error;              // relMSE of the image
  std::optional<double> time;                      // seconds from the first ray
  int priority = 0;                                // higher first
  std::vector<std::string> tags;                   // a worker must carry all of them
  std::string replay = "lightshaft render SCENE";  // without pixel and sample: common/job/replay_command.h
  // ---- whose turn it is, and how much at once (share_book.h, docs/design/scheduling.md) ----
  std::string owner;  // the user (JobView::owner); empty: the administrator, whom no limit of users holds
  std::string group;  // jobs of one owner that share their turns and go in order: a sequence; empty: itself
  // Limits of the job, or of all jobs of its group together.
  std::uint32_t max_workers = 0;   // that may hold units of it at once; 0: any number
  std::uint32_t max_units = 0;     // lent at once; 0: any number
  std::uint64_t memory_bytes = 0;  // that a worker must have for it, at least; 0: not known
};

// ---- jobs
struct JobSubmitted {
  JobPlan plan;
};

// After a restart, before any other event of the job.
struct JobRestored {
  struct Unit {
    TileIndex tile = 0;
    RoundIndex round = 0;
    SampleRange samples;  // one that is no longer wanted (a cut round, extended since) is passed over
    Digest digest;
    WorkerId worker;
  };
  JobPlan plan;
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;    // of a job that is done
  std::optional<Digest> numeric_class;  // it was pinned to
  std::vector<Unit> accepted;           // durable results, in any order
  std::vector<RoundIndex> folded;       // rounds in the restored film (with tails), by tile; empty: none.
                                        // A job that is done must have them
  std::vector<std::vector<double>>
      rel_error;               // [round][tile] of what is folded, as UnitFolded said; only with a target
  double elapsed_seconds = 0;  // since its first ray, before the restart
  // Results that were being rendered again (Farm::open_audits).
  struct Audit {
    TileIndex tile = 0;
    RoundIndex round = 0;
    std::optional<std::pair<WorkerId, Digest>> second;  // what another worker said, if it was not the same
    bool operator==(const Audit&) const = default;
  };
  std::vector<Audit> audits;
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
// Finish with what is leased: the job ends as `done`, stopped by the user.
struct JobStopped {
  JobId job;
};
struct JobPriority {
  JobId job;
  int priority = 0;
};
// Another target error for a job that has one and was not stopped otherwise (Farm::may_retarget). A smaller
// one also takes up again what a larger one ended, and gives the bits of a job that had it from the first,
// since what was not good enough for the larger one was not for it. A larger one counts from where the job
// is.
struct JobRetargeted {
  JobId job;
  double target_error = 0;  // relMSE
};
// To this new total, of a running, paused or done job. Of one whose end is decided a target error or time no
// longer applies: all its tiles get the samples asked for.
struct JobExtended {
  JobId job;
  std::uint64_t spp = 0;
};
// Forget a job that has ended; its id may come again with JobRestored only.
struct JobForgotten {
  JobId job;
};

// ---- workers
// A stream has been registered. An older stream of the same worker counts as lost.
struct WorkerJoined {
  WorkerId worker;
  std::uint64_t epoch = 0;
  std::string name;
  Digest numeric_class;
  int threads = 1;
  std::vector<std::string> tags;
  std::uint64_t memory_bytes = 0;  // that its renderer may use; 0: not told, then it is given anything
  std::vector<Digest> blobs_held;  // in its cache, the most recently used first
};
// Known to have rendered wrong pixels, from before a restart or by another coordinator: it gets no work, and
// what it has rendered of jobs that are here is void.
struct WorkerBarred {
  WorkerId worker;
  std::string why;
};
// The stream has closed. With an epoch that is not the worker's last it means nothing.
struct WorkerLost {
  WorkerId worker;
  std::uint64_t epoch = 0;
};
struct WorkerDrains {
  WorkerId worker;
};
struct LeaseProgress {
  WorkerId worker;
  std::vector<WorkerProgress::Entry> leases;
};
// A result of this worker's has come and waits until the coordinator has room for it; behind it all else that
// the worker says waits, too. That is no fault of the worker's: its leases go on.
struct ResultsWait {
  WorkerId worker;
};
struct LeaseCameBack {
  WorkerId worker;
  LeaseReturned returned;
};

// ---- units
// A verified and durable result. Raised once per arrival; the farm sorts out duplicates.
struct UnitAccepted {
  UnitKey unit;
  SampleRange samples;
  Digest digest;
  WorkerId worker;
  double cpu_seconds = 0;
  double wait_seconds = 0;  // that its thread waited meanwhile: core_share.h
};
// The assembler did what Fold asked for.
struct UnitFolded {
  UnitKey unit;
  SampleRange samples;  // as Fold named them
  // Sum over pixels and channels of the tile's relative squared error, with all rounds up to this one:
  // TileError::relative.squares of common/image/error_estimate.h.
  double rel_error_sum = 0;
};
// What the worker said, or the service itself of a result that is not what it claims to be.
struct UnitFailed {
  WorkerId worker;
  UnitFailure failure;
};

// Raised regularly (about once a second): deadlines, speculation, forgiveness, time budgets.
struct Tick {};

using Event = std::variant<JobSubmitted, JobRestored, JobCancelled, JobPaused, JobResumed, JobStopped,
                           JobPriority, JobRetargeted, JobExtended, JobForgotten, WorkerJoined, WorkerBarred,
                           WorkerLost, WorkerDrains, LeaseProgress, ResultsWait, LeaseCameBack, UnitAccepted,
                           UnitFolded, UnitFailed, Tick>;

}  // namespace ls::coordinator
