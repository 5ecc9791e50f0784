// All limits and constants of the farm's decisions. The stop rule of jobs with a target error
// (adaptive_stop.h) goes through levels, which determine how many samples each tile gets; each further level
// gives more. Terms: docs/reference/glossary.md.
#pragma once

#include <cstdint>

#include "core/base/clock.h"
#include "core/image/frame/render_limits.h"
#include "core/image/frame/rounds.h"
#include "core/job/limits.h"

namespace ls::coordinator {

using namespace std::chrono_literals;

// Jobs

// The sample limit, per pixel, of a job that gives only a target error or a time
inline constexpr std::uint64_t kMaxSppWithoutLimit = 65536;

// Messages name a numeric class by this many hexadecimal digits
inline constexpr std::size_t kClassDigits = 12;

// Leases

// Wall-clock seconds for which a lease should occupy all threads of a worker
inline constexpr double kLeaseSeconds = 2.0;
// A lease that its worker has been rendering for longer than this, in wall-clock seconds, is recalled: the
// worker gives back the units that it has not begun. The size of leases is chosen by predicted costs, which
// may be wrong; this limit is what holds.
inline constexpr double kLeaseLimit = 2 * kLeaseSeconds;
// Lower bound of the share of a core that a worker's thread is taken to get (CoreShare in worker_table.h)
inline constexpr double kLeastCoreShare = 1.0 / 64;
// A lease has at most this many units, so that the message that assigns it stays well below 1 MiB
inline constexpr std::uint32_t kMaxLeaseUnits = 1024;
// A worker normally holds this many leases: one that it renders, and two that wait
inline constexpr std::uint32_t kQueuedLeases = 3;
// A worker gets leases until it holds at least this many units per thread, even if each takes long: one unit
// that the thread renders, and one that waits
inline constexpr std::uint32_t kUnitsAThread = 2;
// A speculative unit (the job may end without it) goes only to a worker that holds fewer than kUnitsAThread
// units per thread, or whose leased work takes less than this many seconds. Without the second condition a
// worker with short units would be idle until its next lease arrives.
inline constexpr double kSpeculativeSeconds = .05;
// A worker holds at most this many leases. It gets so many only near the end of a job, when a lease may be a
// single unit
inline constexpr std::uint32_t kMaxLeasesPerWorker = 64;
// A lease's deadline is the time when it was granted, plus kDeadlineFactor times its predicted duration, plus
// kDeadlineSlack. If the worker has not finished a unit of the job yet, it may have to load the scene, and
// kLoadSlack is added, too
inline constexpr double kDeadlineFactor = 3.0;
inline constexpr Duration kDeadlineSlack = 10s;
inline constexpr Duration kLoadSlack = 120s;
// If a worker finishes no unit for this long, its progress reports no longer renew its leases
inline constexpr Duration kNoGrowthLimit = 600s;
// A lease is moved to an idle worker if it would wait longer than this behind other leases of its worker. The
// time is long compared with the time that it takes to send a lease.
inline constexpr Duration kTakeBackAfter = 20ms;
// A lease is overdue when more than kSpeculateAfter times its predicted duration plus kSpeculateSlack have
// passed since it was granted. Idle workers may then render copies of its units
inline constexpr double kSpeculateAfter = 1.5;
inline constexpr Duration kSpeculateSlack = 1s;
// A search for units that an idle worker can copy or take over looks at no more leases than this
inline constexpr std::uint32_t kSpeculationScan = 64;

// Fair shares

// Greatest plausible CPU time of one unit, in seconds; the time of a result that reports more is ignored
inline constexpr double kMostUnitSeconds = 86400;
inline double plausible_seconds(double reported) {
  return reported >= 0 && reported <= kMostUnitSeconds ? reported : 0;
}
// Core seconds charged for a unit until a cost is measured for its job
inline constexpr double kAssumedUnitSeconds = 1.0;
// Loading a scene takes time. So a worker may get units of a job whose scene it has loaded, although a job of
// another user is next in turn. The condition is that the lag of the loaded job (fair_share.h), in core
// seconds, exceeds that of the job in turn by at most kLocalitySeconds times the number of the farm's
// threads.
inline constexpr double kLocalitySeconds = 5.0;
// At most this many jobs are checked to find one whose scene the worker has loaded
inline constexpr std::uint32_t kJobsLookedAt = 64;
// A worker reports which blobs (files of scenes) it holds; at most this many of them are remembered for each
// worker
inline constexpr std::size_t kBlobsRemembered = 1024;

// Audits. In an audit another worker renders the unit of an accepted result again, for comparison.

// At most this many audits of one job are open at the same time
inline constexpr std::size_t kMaxAuditsOpen = 64;
// Workers need time to reconnect after a restart of the coordinator. An audit that was open then is dropped
// only if no worker can render its unit this long after the restart
inline constexpr Duration kAuditAfterRestart = 60s;
// At most this many pairs of unit and worker are kept in a job's VoterTable
inline constexpr std::size_t kMaxVoters = 65'536;

// For each tile at most this many rounds are leased beyond those that are in the image. This limits how many
// results wait to be folded (added to the image)
inline constexpr RoundIndex kRoundsAhead = 64;

// Failures

// A job fails when one of its units has failed at kUnitFailureWorkers distinct principals (Worker::principal)
// and in at least kUnitFailureAttempts attempts. Fewer are enough if the connected workers that could render
// the job are of fewer principals. Where some of these workers have delivered results, only those count
inline constexpr std::uint32_t kUnitFailureWorkers = 3;
inline constexpr std::uint32_t kUnitFailureAttempts = 2;
// A job is pinned to the numeric class of its first lease; until a result of that class is accepted, the pin
// may move. If none was accepted for this long, and an idle worker of another class could render the job, the
// pin is released. The time doubles with each such release.
inline constexpr Duration kPinLimit = 60s;
// After this many failures a worker gets no more units of the job
inline constexpr std::uint32_t kWorkerFailuresPerJob = 3;
// A worker that is blocked from this many jobs is unhealthy: it gets no work at all
inline constexpr std::uint32_t kUnhealthyJobs = 2;
// A worker's failures are forgiven this long after the latest of them
inline constexpr Duration kForgiveAfter = 1800s;
inline constexpr Duration kForgetWorkerAfter = 3600s;  // a worker is forgotten this long after it was lost
// Of workers that were lost before they finished a unit, only so many are remembered: otherwise one who joins
// and leaves again and again would fill the table of workers
inline constexpr std::size_t kLostNewcomersKept = 64;
// Names of workers that nothing refers to are dropped when the number of names exceeds 2 n + kNamesKept,
// where n is the number of names that the previous cleanup kept (WorkerTable::has_many_names)
inline constexpr std::size_t kNamesKept = 256;
inline constexpr std::uint32_t kMaxNamedWorkers = 8;  // one message names at most this many workers

// Leases without results

// A worker that has given back this many leases of a job, or not finished them in time, without a result in
// between, is not waited for: an audit that only such workers could render is dropped. The same holds for
// all jobs after this many such leases of any jobs without a result of any job in between
inline constexpr std::uint32_t kFruitlessLeases = 3;
// After the second such lease the worker gets no unit of the job for kFruitlessPause; each further one
// doubles the pause, up to kFruitlessPauseMost. So a worker with a full disk costs others nothing, and works
// again soon after there is room
inline constexpr Duration kFruitlessPause = 2s, kFruitlessPauseMost = 60s;
// An audit is dropped after this many leases without a result, of all workers together
inline constexpr std::uint32_t kAuditLeases = 10;
// After this many losses of workers that held units of a job, without a result in between, the job says so
inline constexpr std::uint32_t kLossesInARow = 5;
// Most memory for briefs that is counted on, whatever a worker offers; in bytes (BriefMemory)
inline constexpr std::uint64_t kBriefBytesMost = 16 << 20;

// Stopping

// Samples per pixel that every tile gets before its error may stop it
inline constexpr std::uint64_t kMinSppBeforeStop = 64;
inline constexpr int kMinStopPixels = 1024;  // fewest pixels in a group of tiles that stop together
// Seconds of work that the leases of a worker normally hold. The last units of a job with a time limit are
// chosen (plan_end in farm_stop.cpp) when at most twice this time is left.
inline constexpr double kTimePlanned = kQueuedLeases * kLeaseSeconds;
// The next checkpoint is taken at a level of the stop rule with at least this many times the samples of the
// previous checkpoint's level. The last level gets a checkpoint in any case
inline constexpr double kCheckpointGrowth = 1.15;
// The error of the denoised layers is checked again at a level with at least this many times the samples of
// the previous check's level. The factor is larger than kCheckpointGrowth, since denoising takes as long as
// rendering a few samples per pixel
inline constexpr double kDenoisedCheckGrowth = 1.4;

}  // namespace ls::coordinator
