// All limits and constants of the farm's decisions. A unit is one round (range of samples) of one tile; a
// lease is a list of units that one worker was told to render.
#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "common/image/frame/render_limits.h"
#include "common/image/frame/rounds.h"
#include "common/job/limits.h"

namespace ls::coordinator {

using namespace std::chrono_literals;

// Jobs

// Most samples per pixel of a job that gives only a target error or a time
inline constexpr std::uint64_t kMaxSppWithoutLimit = 65536;

// Leases
inline constexpr double kLeaseSeconds = 2.0;  // a lease should keep all threads of a worker busy this long
// Lower bound for the share of a core that a worker's thread gets
inline constexpr double kLeastCoreShare = 1.0 / 64;
// Units in one lease: keeps the message that assigns it well below 1 MiB
inline constexpr std::uint32_t kMaxLeaseUnits = 1024;
// Leases that a worker holds: one being rendered, two ahead
inline constexpr std::uint32_t kQueuedLeases = 3;
// Units per thread that a worker holds: one being rendered, one ahead, even if units take long
inline constexpr std::uint32_t kUnitsAThread = 2;
// Speculative units (units that may turn out not to be needed) go only to workers whose queued work takes
// less than this many seconds. With 0 a worker would wait for a message between two small units.
inline constexpr double kSpeculativeSeconds = .05;
inline constexpr std::uint32_t kMaxLeasesPerWorker = 64;  // near the end of a job a lease is a single unit
// A lease's deadline is this many times its predicted duration away, plus the slacks below
inline constexpr double kDeadlineFactor = 3.0;
inline constexpr Duration kDeadlineSlack = 10s;  // added to every lease's deadline
// Added, too, until the worker has finished a unit of the job: it may have to load the world
inline constexpr Duration kLoadSlack = 120s;
// If a worker finishes no unit for this long, its progress reports no longer renew its leases
inline constexpr Duration kNoGrowthLimit = 600s;
// A lease that will wait at least this long behind other work of its worker is moved to an idle worker. The
// time is far longer than it takes to send a lease.
inline constexpr Duration kTakeBackAfter = 20ms;
// Idle workers may copy the units of a lease after kSpeculateAfter times its predicted duration plus
// kSpeculateSlack
inline constexpr double kSpeculateAfter = 1.5;
inline constexpr Duration kSpeculateSlack = 1s;
// Leases that are checked when an idle worker looks for units to copy or take over
inline constexpr std::uint32_t kSpeculationScan = 64;

// Fair shares
inline constexpr double kMostUnitSeconds = 86400;  // a time that a result reports is ignored if it is longer
inline double plausible_seconds(double reported) {
  return reported >= 0 && reported <= kMostUnitSeconds ? reported : 0;
}
// Core seconds charged for a unit while nothing of its job is measured
inline constexpr double kAssumedUnitSeconds = 1.0;
// A worker may go on with a job whose world it holds instead of loading another, as long as that job's lag
// (fair_share.h) is at most this many seconds times the farm's threads greater than that of the job in turn.
inline constexpr double kLocalitySeconds = 5.0;
inline constexpr std::uint32_t kJobsLookedAt = 64;  // jobs checked to find one whose world the worker holds
// Blobs remembered of those that a worker reports to hold
inline constexpr std::size_t kBlobsRemembered = 1024;

// Audits

// audits open at the same time per job; at this number no further one begins
inline constexpr std::size_t kMaxAuditsOpen = 64;
// Time for workers to reconnect before a restored audit is dropped
inline constexpr Duration kAuditAfterRestart = 60s;
// Pairs of unit and worker remembered per job: voter_table.h
inline constexpr std::size_t kMaxVoters = 65'536;

// Rounds that may be leased ahead of the folded ones
inline constexpr RoundIndex kRoundsAhead = 64;  // bounds how many results wait to be folded

// Failures

// A job fails when one of its units has failed on kUnitFailureWorkers distinct workers and in at least
// kUnitFailureAttempts attempts. Fewer workers are enough if fewer are connected
inline constexpr std::uint32_t kUnitFailureWorkers = 3;
inline constexpr std::uint32_t kUnitFailureAttempts = 2;
// After so many failures a worker gets no more units of the job
inline constexpr std::uint32_t kWorkerFailuresPerJob = 3;
// A worker that is blocked from so many jobs is unhealthy: it gets no work at all
inline constexpr std::uint32_t kUnhealthyJobs = 2;
// A worker's failures are forgiven this long after the last one
inline constexpr Duration kForgiveAfter = 1800s;
inline constexpr Duration kForgetWorkerAfter = 3600s;  // a worker is forgotten this long after it was lost
// How many names of workers that are gone may be kept before unused ones are dropped
// (WorkerTable::has_many_names)
inline constexpr std::size_t kNamesKept = 256;
inline constexpr std::uint32_t kMaxNamedWorkers = 8;  // workers that one message names

// Stopping

// samples per pixel that every tile gets before it may stop for its error
inline constexpr std::uint64_t kMinSppBeforeStop = 64;
inline constexpr int kMinStopPixels = 1024;  // fewest pixels in a group of tiles that stop together
// Seconds of work that a worker's leases hold. At twice this before its time limit a job's end is planned.
inline constexpr double kTimePlanned = kQueuedLeases * kLeaseSeconds;
// Of two levels of the stop rule that make checkpoints one after the other, the later has at least this many
// times the samples of the earlier
inline constexpr double kCheckpointGrowth = 1.15;

}  // namespace ls::coordinator
