// All limits and constants of the farm's decisions. A unit is one round (range of samples) of one tile; a
// lease is a list of units that is assigned to one worker.
#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "common/image/frame/render_limits.h"
#include "common/image/frame/rounds.h"
#include "common/job/limits.h"

namespace ls::coordinator {

using namespace std::chrono_literals;

// Jobs

// The sample limit, per pixel, of a job that gives only a target error or a time
inline constexpr std::uint64_t kMaxSppWithoutLimit = 65536;

// Messages name a numeric class by this many hexadecimal digits
inline constexpr std::size_t kClassDigits = 12;

// Leases
inline constexpr double kLeaseSeconds = 2.0;  // work that a lease should give to all threads of a worker
// The share of a core that a worker's thread gets (CoreShare in worker_table.h) is taken to be at least this
inline constexpr double kLeastCoreShare = 1.0 / 64;
// A lease has at most this many units, so that the message that assigns it stays well below 1 MiB
inline constexpr std::uint32_t kMaxLeaseUnits = 1024;
// Leases that a worker holds: one that it renders, and two that wait
inline constexpr std::uint32_t kQueuedLeases = 3;
// Units per thread that a worker holds, even if units take long: one that it renders, and one that waits
inline constexpr std::uint32_t kUnitsAThread = 2;
// A speculative unit (the job may end without it) goes only to a worker that holds fewer than kUnitsAThread
// units per thread, or whose leased work takes less than this many seconds. Without the second condition a
// worker with small units would idle until the next message.
inline constexpr double kSpeculativeSeconds = .05;
// A worker holds at most this many leases. This matters near the end of a job, when a lease may be a single
// unit
inline constexpr std::uint32_t kMaxLeasesPerWorker = 64;
// A lease's deadline is this many times its predicted duration after it was granted, plus kDeadlineSlack and
// perhaps kLoadSlack
inline constexpr double kDeadlineFactor = 3.0;
inline constexpr Duration kDeadlineSlack = 10s;  // added to every lease's deadline
// Also added until the worker has finished a unit of the job: it may have to load the world
inline constexpr Duration kLoadSlack = 120s;
// If a worker finishes no unit for this long, its progress reports no longer renew its leases
inline constexpr Duration kNoGrowthLimit = 600s;
// A lease is moved to an idle worker if it would wait longer than this behind other work of its worker.
// Sending a lease takes far less time.
inline constexpr Duration kTakeBackAfter = 20ms;
// Idle workers may copy the units of a lease after kSpeculateAfter times its predicted duration plus
// kSpeculateSlack
inline constexpr double kSpeculateAfter = 1.5;
inline constexpr Duration kSpeculateSlack = 1s;
// At most this many leases are searched for units that an idle worker can copy or take over
inline constexpr std::uint32_t kSpeculationScan = 64;

// Fair shares
inline constexpr double kMostUnitSeconds = 86400;  // longer times reported by results are ignored
inline double plausible_seconds(double reported) {
  return reported >= 0 && reported <= kMostUnitSeconds ? reported : 0;
}
// Core seconds charged for a unit until a cost is measured for its job
inline constexpr double kAssumedUnitSeconds = 1.0;
// A worker may get units of a job whose world (scene) it has loaded although another job is next in turn, as
// long as the lag (fair_share.h) of the loaded job exceeds that of the next one by at most this many seconds
// times the farm's threads. This saves loading worlds.
inline constexpr double kLocalitySeconds = 5.0;
// at most this many jobs are checked to find one whose world the worker has loaded
inline constexpr std::uint32_t kJobsLookedAt = 64;
// At most this many blobs are remembered per worker, of those that it reports to hold
inline constexpr std::size_t kBlobsRemembered = 1024;

// Audits. In an audit another worker renders the unit of an accepted result again, for comparison.

// At most this many audits of one job are open at the same time
inline constexpr std::size_t kMaxAuditsOpen = 64;
// Time for workers to reconnect before a restored audit is dropped
inline constexpr Duration kAuditAfterRestart = 60s;
// At most this many pairs of unit and worker are kept in a job's VoterTable
inline constexpr std::size_t kMaxVoters = 65'536;

// At most this many rounds are leased ahead of those in the image. This limits how many results wait to be
// folded (added to the image)
inline constexpr RoundIndex kRoundsAhead = 64;

// Failures

// A job fails when one of its units has failed on kUnitFailureWorkers distinct workers and in at least
// kUnitFailureAttempts attempts. Fewer workers are enough if fewer connected workers could render the job
inline constexpr std::uint32_t kUnitFailureWorkers = 3;
inline constexpr std::uint32_t kUnitFailureAttempts = 2;
// After this many failures a worker gets no more units of the job
inline constexpr std::uint32_t kWorkerFailuresPerJob = 3;
// A worker that is blocked from this many jobs is unhealthy: it gets no work at all
inline constexpr std::uint32_t kUnhealthyJobs = 2;
// A worker's failures are forgiven this long after the latest of them
inline constexpr Duration kForgiveAfter = 1800s;
inline constexpr Duration kForgetWorkerAfter = 3600s;  // a worker is forgotten this long after it was lost
// Unused names of workers are dropped when the number of all names exceeds twice the number that the previous
// such cleanup kept, plus this (WorkerTable::has_many_names)
inline constexpr std::size_t kNamesKept = 256;
inline constexpr std::uint32_t kMaxNamedWorkers = 8;  // one message names at most this many workers

// Stopping

// samples per pixel that every tile gets before its error may stop it
inline constexpr std::uint64_t kMinSppBeforeStop = 64;
inline constexpr int kMinStopPixels = 1024;  // fewest pixels in a group of tiles that stop together
// Seconds of work that the leases of a worker hold. The last units of a job are chosen (farm_stop.cpp:
// plan_end) when its time limit is at most twice this away.
inline constexpr double kTimePlanned = kQueuedLeases * kLeaseSeconds;
// The next checkpoint is made at a level of the stop rule with at least this many times the samples of the
// previous checkpoint's level (except at the last level)
inline constexpr double kCheckpointGrowth = 1.15;
// The error of the denoised layers is checked again at a level with at least this many times the samples of
// the previous check's level. The factor is larger, since denoising takes as long as a few samples per pixel
inline constexpr double kDenoisedCheckGrowth = 1.4;

}  // namespace ls::coordinator
