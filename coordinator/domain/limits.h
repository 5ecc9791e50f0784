// Every limit and constant of the farm's decisions, in one place.
#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "common/image/rounds.h"

namespace ls::coordinator {

using namespace std::chrono_literals;

// ---- jobs ----
inline constexpr std::uint64_t kMaxSppWithoutLimit =
    65536;  // of a job that only names a target error or a time
inline constexpr std::uint64_t kMaxUnitsPerJob = 1ull << 26;  // 40 bytes each once accepted
inline constexpr std::uint32_t kMaxTiles = 1u << 22;

// ---- leases ----
inline constexpr double kLeaseSeconds = 2.0;  // that a lease should keep all threads of a worker busy
inline constexpr double kLeastCoreShare =
    1.0 / 64;  // of a core that a worker's thread is taken to have, at least
inline constexpr std::uint32_t kMaxLeaseUnits = 1024;  // keeps an assignment well below 1 MiB
inline constexpr std::uint32_t kLeasesPerWorker = 3;   // one being rendered, two ahead
inline constexpr std::uint32_t kUnitsAThread = 2;  // one being rendered, one ahead, however long they take
// Of units that are only probably wanted: what a worker may have besides, or it would wait for messages
// between small ones.
inline constexpr double kForeseenSeconds = .05;
inline constexpr std::uint32_t kMaxLeasesPerWorker = 64;  // at a job's tail leases are single units
inline constexpr double kDeadlineFactor = 3.0;            // of the predicted duration
inline constexpr Duration kDeadlineSlack = 10s;
inline constexpr Duration kLoadSlack = 120s;  // more, until a worker has finished a unit of the job
inline constexpr Duration kNoGrowthLimit =
    600s;  // progress without a finished unit renews no longer than this
// A unit that waits this long behind others of its worker is moved to an idle one: far above a lease's way
// there.
inline constexpr Duration kTakeBackAfter = 20ms;
inline constexpr double kSpeculateAfter = 1.5;  // of the predicted duration: then idle workers may copy units
inline constexpr Duration kSpeculateSlack = 1s;
inline constexpr std::uint32_t kSpeculationScan = 64;  // oldest leases looked at for one idle worker

// ---- whose turn it is ----
inline constexpr double kMostUnitSeconds = 86400;  // what a result reports beyond is not believed
inline double believed_seconds(double reported) {
  return reported >= 0 && reported <= kMostUnitSeconds ? reported : 0;
}
inline constexpr double kAssumedUnitSeconds =
    1.0;  // charged for a unit of a job of which nothing is measured
// So much longer than fair all threads may go on with jobs whose world they hold before they load another.
inline constexpr double kLocalitySeconds = 5.0;
inline constexpr std::uint32_t kJobsLookedAt = 64;     // for one whose world the worker holds
inline constexpr std::size_t kBlobsRemembered = 1024;  // of what a worker says it holds

// ---- audits ----
inline constexpr std::size_t kMaxAuditsOpen = 64;  // of one job; beyond, none is begun
inline constexpr Duration kAuditAfterRestart =
    60s;  // that workers have to come back for one, before it is dropped
inline constexpr std::size_t kMaxWitnesses = 65'536;  // units and workers of one job: witness_book.h

// ---- rounds leased ahead of what is folded over all tiles ----
inline constexpr RoundIndex kRoundsAhead = 64;  // bounds what waits to be folded

// ---- failures ----
inline constexpr std::uint32_t kUnitFailureWorkers = 3;   // a unit may fail on so many distinct workers...
inline constexpr std::uint32_t kUnitFailureAttempts = 2;  // ...and at least so often
inline constexpr std::uint32_t kWorkerFailuresPerJob = 3;
inline constexpr std::uint32_t kSickJobs = 2;
inline constexpr Duration kForgiveAfter = 1800s;
inline constexpr Duration kForgetWorkerAfter = 3600s;  // lost for so long
inline constexpr std::size_t kNamesKept =
    256;  // of workers that are gone; beyond, it is looked who is still needed
inline constexpr std::uint32_t kMaxNamedWorkers = 8;  // in a message

// ---- stopping ----
inline constexpr std::uint64_t kMinSppBeforeStop = 64;
inline constexpr int kMinStopPixels = 1024;                               // that decide together
inline constexpr double kTimePlanned = kLeasesPerWorker * kLeaseSeconds;  // seconds before a time limit
inline constexpr double kCheckpointGrowth = 1.15;  // of samples from one level with a checkpoint to the next

}  // namespace ls::coordinator
