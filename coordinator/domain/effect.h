// Effects: the actions that the farm requests. The service carries them out in the order given. A partial is
// the encoded pixel sums of one unit. To fold a partial is to add it to the job's image, its film. Terms:
// docs/reference/glossary.md. Terms: docs/reference/glossary.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/job_failure.h"
#include "coordinator/domain/job_state.h"
#include "core/base/digest.h"
#include "core/base/id.h"
#include "util/protocol/messages.h"

namespace ls::coordinator {

// Send this message to the worker: an AssignLease (the units in it are leased to the worker from now on), a
// CancelLease or a CancelJob.
struct Send {
  WorkerId worker;
  ToWorker message;
};

// These units are no longer part of this lease. If they are still needed and no other lease holds them, they
// wait for another worker. `audit`: the lease was an audit, in which a unit that already has an accepted
// result is rendered again, for comparison.
struct UnitsFreed {
  JobId job;
  LeaseId lease;
  WorkerId worker;
  std::vector<UnitKey> units;
  FreedCause cause = FreedCause::worker_lost;
  bool audit = false;
};

// The farm has accepted this result of the unit. Store its digest and the worker that delivered it.
struct RecordUnit {
  UnitKey unit;
  SampleRange samples;
  Digest digest;
  WorkerId worker;
};

// Fold this unit's accepted partial, then raise the event UnitFolded. The farm requests the rounds of a tile
// in order, none after the tile's last one. It requests each round once, and again only if TileDiscarded or
// ReopenRound has removed the round from the film.
struct Fold {
  UnitKey unit;
  SampleRange samples;
};

// The worker delivered a second result of a unit, equal to the accepted one. The second one is dropped.
struct DropDuplicate {
  UnitKey unit;
  WorkerId worker;
};
// The worker delivered a result that is not needed. `why` is the reason: the worker is quarantined, the job
// has ended, the round is after the tile's last one, or the result has another sample range or numeric class
// than the job needs.
struct DropUnwanted {
  UnitKey unit;
  WorkerId worker;
  std::string why;
};
// Two results of one unit differ although both workers are of one numeric class, so one of the workers has
// bad memory or lies. A third worker decides (farm_trust.cpp). If no third worker exists, the job fails,
// unless it has ended or the second worker held no lease on the unit.
struct DigestMismatch {
  UnitKey unit;
  Digest first, second;
  WorkerId first_worker, second_worker;
};

// Only workers of this numeric class may render the job from now on. Until a result is accepted, JobUnpinned
// may take this back.
struct JobPinned {
  JobId job;
  Digest numeric_class;
};
// The job has no numeric class any more: no result of the class was accepted, and its leases are gone.
struct JobUnpinned {
  JobId job;
};
struct JobStateChanged {
  JobId job;
  JobState from = JobState::queued;
  JobState to = JobState::queued;
};
// The image has at least `rounds[tile]` rounds of each tile. The service adds a point to the convergence
// curve and may take a snapshot. In a job with a target error, tiles may stop at different rounds once each
// has kMinSppBeforeStop samples per pixel. Each later checkpoint belongs to a level of the stop rule
// (coordinator/domain/adaptive_stop.h) and has the rounds at which the tiles stop at that level. The
// checkpoints and their order do not depend on the order in which results arrive.
struct Checkpoint {
  JobId job;
  std::vector<RoundIndex> rounds;  // for each tile, how many of its rounds the checkpoint includes
  double spp = 0;                  // samples per pixel, mean over all pixels
};
// Compute the error of this job's denoised layers, to which its target error applies. The film contains
// exactly the rounds of the stop rule's current level (adaptive_stop.h), which has `spp` samples per pixel,
// mean over all pixels. The film does not change until the event DenoisedChecked is raised. If the layers
// cannot be made, the service pauses the job; the farm repeats this effect when the job is resumed.
struct CheckDenoised {
  JobId job;
  double spp = 0;
};
// The job has been extended, and its old sample count had truncated its last round, `round`. This round is
// rendered again in full: its pixel sums in the film (the tail) are replaced when the full round is folded,
// and its stored partials are void.
struct ReopenRound {
  JobId job;
  RoundIndex round = 0;
};
// The job is done: its image contains all units that it needs. This effect follows the JobStateChanged to
// `done`.
struct JobFinished {
  JobId job;
  StopReason stopped = StopReason::spp;
  // Number of results that were chosen for an audit but not audited, since no other worker of the numeric
  // class was connected
  std::uint64_t unaudited = 0;
};
// The job has failed. `error` is the message for the user: what failed, where, what the workers reported and
// how to replay it. This effect follows the JobStateChanged to `failed`.
struct JobFailed {
  JobId job;
  std::string error;
  std::optional<JobFailure> failure = {};  // the same as data, if a unit could not be rendered
};

struct WorkerStateChanged {
  WorkerId worker;
  WorkerState to = WorkerState::connected;
  std::string why;
};
// The worker has failed too often on units of this job, so it gets no more of them for a while.
struct WorkerBlocked {
  WorkerId worker;
  JobId job;
  std::string why;
};
// The worker has given back kFruitlessLeases leases of this job, or not finished them in time, without a
// result in between. It is still offered units of the job, but nobody waits for it. `why`: of the latest.
struct WorkerFruitless {
  WorkerId worker;
  JobId job;
  std::string why;
};
// This worker rendered wrong pixels: two other workers agree on other pixels, or the worker delivered two
// different results of one unit. It gets no more work of any job, and its messages are ignored. The service
// must store this before it carries out the effects that follow; after a restart none of the worker's results
// may be accepted.
struct WorkerFoundFaulty {
  WorkerId worker;
  UnitKey unit;  // the unit whose differing results revealed the worker
  std::string evidence;
};
// The pixels of this tile are void, since a quarantined worker rendered part of them. In a job with a target
// error all tiles are void if the worker rendered part of any, since the errors of a tile influence the
// samples of the others. The tile restarts from round 0, and none of its earlier results count.
struct TileDiscarded {
  JobId job;
  TileIndex tile = 0;
};
// The farm has forgotten a worker that was lost long ago.
struct WorkerForgotten {
  WorkerId worker;
};

using Effect = std::variant<Send, UnitsFreed, RecordUnit, Fold, DropDuplicate, DropUnwanted, DigestMismatch,
                            JobPinned, JobUnpinned, JobStateChanged, Checkpoint, CheckDenoised, ReopenRound,
                            JobFinished, JobFailed, WorkerStateChanged, WorkerBlocked, WorkerFruitless,
                            WorkerFoundFaulty, TileDiscarded, WorkerForgotten>;

}  // namespace ls::coordinator
