// All limits and constants of the farm's decisions.
#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "common/image/frame/render_limits.h"
#include "common/image/frame/rounds.h"
#include "common/job/limits.h"

namespace ls::coordinator {

using namespace std::chrono_literals;

// Jobs
// Of a job that gives only a target error or a time
inline constexpr std::uint64_t kMaxSppWithoutLimit = 65536;

// Leases
inline constexpr double kLeaseSeconds = 2.0;  // that a lease should keep all threads of a worker busy
// Lower bound for the share of a core that a worker's thread gets
inline constexpr double kLeastCoreShare = 1.0 / 64;
inline constexpr std::uint32_t kMaxLeaseUnits = 1024;  // keeps an assignment well below 1 MiB
inline constexpr std::uint32_t kQueuedLeases = 3;      // one being rendered, two ahead
inline constexpr std::uint32_t kUnitsAThread = 2;  // one being rendered, one ahead, even if units take long
// Speculative units go only to workers with less queued work than this; 0 would make the worker wait for a
// message between small units.
inline constexpr double kSpeculativeSeconds = .05;
inline constexpr std::uint32_t kMaxLeasesPerWorker = 64;  // at a job's tail a lease is a single unit
inline constexpr double kDeadlineFactor = 3.0;            // times the predicted duration
inline constexpr Duration kDeadlineSlack = 10s;
inline constexpr Duration kLoadSlack = 120s;  // extra, until the worker has finished a unit of the job
// Progress reports without a finished unit renew leases no longer than this
inline constexpr Duration kNoGrowthLimit = 600s;
// A unit that waits this long behind others of its worker is moved to an idle one. Far longer than it takes
// to send a lease.
inline constexpr Duration kTakeBackAfter = 20ms;
// Times the predicted duration: then idle workers may copy units
inline constexpr double kSpeculateAfter = 1.5;
inline constexpr Duration kSpeculateSlack = 1s;
inline constexpr std::uint32_t kSpeculationScan = 64;  // oldest leases checked for one idle worker

// Fair shares
inline constexpr double kMostUnitSeconds = 86400;  // longer reported times are ignored
inline double plausible_seconds(double reported) {
  return reported >= 0 && reported <= kMostUnitSeconds ? reported : 0;
}
inline constexpr double kAssumedUnitSeconds = 1.0;  // charged for a unit while nothing of its job is measured
// All threads may continue with jobs whose world they hold for this long beyond their fair share before they
// load another.
inline constexpr double kLocalitySeconds = 5.0;
inline constexpr std::uint32_t kJobsLookedAt = 64;     // to find one whose world the worker holds
inline constexpr std::size_t kBlobsRemembered = 1024;  // of the blobs that a worker reports to hold

// Audits
inline constexpr std::size_t kMaxAuditsOpen = 64;  // per job; at this number no further audit begins
// Time for workers to reconnect before a restored audit is dropped
inline constexpr Duration kAuditAfterRestart = 60s;
inline constexpr std::size_t kMaxVoters = 65'536;  // pairs of unit and worker per job: voter_table.h

// Rounds leased ahead of those folded over all tiles
inline constexpr RoundIndex kRoundsAhead = 64;  // bounds the results that wait to be folded

// Failures
// a job fails when a unit has failed on this many distinct workers...
inline constexpr std::uint32_t kUnitFailureWorkers = 3;
inline constexpr std::uint32_t kUnitFailureAttempts = 2;  // ...and in at least this many attempts
inline constexpr std::uint32_t kWorkerFailuresPerJob = 3;
inline constexpr std::uint32_t kUnhealthyJobs = 2;
inline constexpr Duration kForgiveAfter = 1800s;
inline constexpr Duration kForgetWorkerAfter = 3600s;  // after it was lost
// Names kept of workers that are gone; with more, unused names are dropped
inline constexpr std::size_t kNamesKept = 256;
inline constexpr std::uint32_t kMaxNamedWorkers = 8;  // in one message

// Stopping
inline constexpr std::uint64_t kMinSppBeforeStop = 64;
inline constexpr int kMinStopPixels = 1024;  // fewest pixels in a group of tiles that stop together
// Time that the leases of a worker cover; planning begins at twice this before a time limit.
inline constexpr double kTimePlanned = kQueuedLeases * kLeaseSeconds;
// Least ratio of samples between two levels that make checkpoints
inline constexpr double kCheckpointGrowth = 1.15;

}  // namespace ls::coordinator
