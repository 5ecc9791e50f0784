// What the farm wants done. Effects are carried out in the order given.
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

// AssignLease (its tiles are now leased to this worker), CancelLease or CancelJob.
struct Send {
  WorkerId worker;
  ToWorker message;
};

// These units are no longer lent under this lease. Those that are still wanted wait for another worker
// (unless another lease holds them too).
struct UnitsFreed {
  JobId job;
  LeaseId lease;
  WorkerId worker;
  std::vector<UnitKey> units;
  FreedCause cause = FreedCause::worker_lost;
};

// This result is the unit's accepted one: record it (unit, worker, digest).
struct RecordUnit {
  UnitKey unit;
  SampleRange samples;
  Digest digest;
  WorkerId worker;
};

// Fold this unit's accepted partial into the film, then raise UnitFolded. Rounds of a tile come in order,
// each once; no round beyond the tile's stop is ever asked for.
struct Fold {
  UnitKey unit;
  SampleRange samples;
};

// A second result of a unit, equal to the first: nothing to do but to let the worker drop it.
struct DropDuplicate {
  UnitKey unit;
  WorkerId worker;
};
// A result nobody wants: of a job that has ended, a round past its stop, another range or numeric class.
struct DropUnwanted {
  UnitKey unit;
  WorkerId worker;
  std::string why;
};
// Two results of one unit differ within one numeric class: one worker has bad memory or lies. A third one is
// asked to render the unit; where there is none, a running job fails.
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
// Every tile is folded as far as this says: time for a point of the convergence curve and a snapshot. With a
// target error tiles have different numbers of rounds: those of one level of the stop rule
// (coordinator/domain/adaptive_stop.h). Which checkpoints there are, and in what order, does not depend on
// the order of arrival.
struct Checkpoint {
  JobId job;
  std::vector<RoundIndex> rounds;  // of each tile that count
  double spp = 0;                  // mean over pixels
};
// With an extension the cut round `round` is rendered again: its folded tail is to be replaced, its partials
// are void.
struct ReopenRound {
  JobId job;
  RoundIndex round = 0;
};
// All that is wanted is folded. Follows the JobStateChanged to `done`.
struct JobFinished {
  JobId job;
  StopReason stopped = StopReason::spp;
  std::uint64_t unaudited =
      0;  // results that were to be rendered again, and no other worker of the class was there
};
// For a person: what failed, where, what the workers said and how to replay it. Follows JobStateChanged to
// `failed`.
struct JobFailed {
  JobId job;
  std::string error;
  std::optional<UnitFailure> failure;  // the one that decided
};

struct WorkerStateChanged {
  WorkerId worker;
  WorkerState to = WorkerState::connected;
  std::string why;
};
// A worker gets no more of this job for a while.
struct WorkerBlocked {
  WorkerId worker;
  JobId job;
  std::string why;
};
// This worker rendered wrong pixels, as two others say: it gets no more work of any job, and nothing it sends
// is taken. To be stored before what follows is carried out; none of its results may be taken up after a
// restart.
struct WorkerDistrusted {
  WorkerId worker;
  UnitKey unit;  // that it was found by
  std::string evidence;
};
// The film of this tile is void, since a worker that is not trusted has rendered some of it: it is folded
// again from round 0. No result of it that was accepted so far counts.
struct TileDiscarded {
  JobId job;
  TileIndex tile = 0;
};
// A worker that was lost long ago is no longer known.
struct WorkerForgotten {
  WorkerId worker;
};

using Effect =
    std::variant<Send, UnitsFreed, RecordUnit, Fold, DropDuplicate, DropUnwanted, DigestMismatch, JobPinned,
                 JobStateChanged, Checkpoint, ReopenRound, JobFinished, JobFailed, WorkerStateChanged,
                 WorkerBlocked, WorkerDistrusted, TileDiscarded, WorkerForgotten>;

}  // namespace ls::coordinator
