// Actions that the farm requests. The service carries them out in the order given.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/base/id.h"
#include "common/protocol/messages.h"
#include "coordinator/domain/freed_cause.h"
#include "coordinator/domain/job_state.h"

namespace ls::coordinator {

// Send the worker an AssignLease (its units are now leased to it), CancelLease or CancelJob.
struct Send {
  WorkerId worker;
  ToWorker message;
};

// These units have left this lease. Those that are still needed wait for another worker, unless another lease
// holds them too.
struct UnitsFreed {
  JobId job;
  LeaseId lease;
  WorkerId worker;
  std::vector<UnitKey> units;
  FreedCause cause = FreedCause::worker_lost;
};

// This result is the unit's accepted one: store it (unit, worker, digest).
struct RecordUnit {
  UnitKey unit;
  SampleRange samples;
  Digest digest;
  WorkerId worker;
};

// Fold this unit's accepted partial into the film, then raise UnitFolded. The rounds of a tile come in order,
// each once, and never beyond the tile's stop.
struct Fold {
  UnitKey unit;
  SampleRange samples;
};

// A second result of a unit, equal to the first: let the worker drop it.
struct DropDuplicate {
  UnitKey unit;
  WorkerId worker;
};
// A result that is not needed: its job has ended, its round is past the tile's stop, or its range or numeric
// class is another.
struct DropUnwanted {
  UnitKey unit;
  WorkerId worker;
  std::string why;
};
// Two results of one unit differ within one numeric class: one worker has bad memory or lies. A third worker
// is asked to render the unit; if there is none, a running job fails.
struct DigestMismatch {
  UnitKey unit;
  Digest first, second;
  WorkerId first_worker, second_worker;
};

struct JobPinned {
  JobId job;
  Digest numeric_class;
};
struct JobStateChanged {
  JobId job;
  JobState from = JobState::queued;
  JobState to = JobState::queued;
};
// Every tile is folded up to the given round: time for a point of the convergence curve and a snapshot. With
// a target error the tiles have different numbers of rounds: those of one level of the stop rule
// (coordinator/domain/adaptive_stop.h). The checkpoints and their order do not depend on the order of
// arrival.
struct Checkpoint {
  JobId job;
  std::vector<RoundIndex> rounds;  // rounds that count, by tile
  double spp = 0;                  // mean over pixels
};
// An extension renders the truncated round `round` again in full: its folded tail is to be replaced, and its
// partials are void.
struct ReopenRound {
  JobId job;
  RoundIndex round = 0;
};
// All units needed are folded. Follows the JobStateChanged to `done`.
struct JobFinished {
  JobId job;
  StopReason stopped = StopReason::spp;
  std::uint64_t unaudited = 0;  // results chosen for an audit when no other worker of the class was connected
};
// The failure for a person to read: what failed, where, what the workers reported and how to replay it.
// Follows the JobStateChanged to `failed`.
struct JobFailed {
  JobId job;
  std::string error;
  std::optional<UnitFailure> failure;  // the failure that ended the job
};

struct WorkerStateChanged {
  WorkerId worker;
  WorkerState to = WorkerState::connected;
  std::string why;
};
// The worker gets no more units of this job for a while.
struct WorkerBlocked {
  WorkerId worker;
  JobId job;
  std::string why;
};
// This worker rendered wrong pixels, according to two others. It gets no more work of any job, and its
// messages are ignored. Store this before carrying out the effects that follow; after a restart none of its
// results may be accepted.
struct WorkerFoundFaulty {
  WorkerId worker;
  UnitKey unit;  // whose results revealed it
  std::string evidence;
};
// The film of this tile is void, since a quarantined worker rendered part of it: the tile is folded again
// from round 0. None of its results accepted so far count.
struct TileDiscarded {
  JobId job;
  TileIndex tile = 0;
};
// The farm has forgotten a worker that was lost long ago.
struct WorkerForgotten {
  WorkerId worker;
};

using Effect =
    std::variant<Send, UnitsFreed, RecordUnit, Fold, DropDuplicate, DropUnwanted, DigestMismatch, JobPinned,
                 JobStateChanged, Checkpoint, ReopenRound, JobFinished, JobFailed, WorkerStateChanged,
                 WorkerBlocked, WorkerFoundFaulty, TileDiscarded, WorkerForgotten>;

}  // namespace ls::coordinator
