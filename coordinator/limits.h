// Every bound of the coordinator's service, store and assembler, in one place.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/clock.h"
#include "common/image/render_limits.h"

namespace ls::coordinator::limits {

// ---- blobs ----
inline constexpr std::uint64_t kMaxBlobBytes = std::uint64_t{1} << 36;   // one file of a scene: 64 GiB
inline constexpr std::uint64_t kMaxBlobRead = std::uint64_t{256} << 20;  // in one read()
inline constexpr std::size_t kMaxUnfinishedUploads = 1024;               // kept to be gone on with
inline constexpr std::uint64_t kMaxIncludeBytes = std::uint64_t{32} << 20;
inline constexpr Duration kAwaitedLook =
    std::chrono::seconds(1);  // between two looks for blobs that jobs wait for

// ---- submission ----
inline constexpr std::size_t kMaxSceneText = std::size_t{32} << 20;
inline constexpr std::size_t kMaxAssets = 100'000;     // named by one request
inline constexpr std::size_t kMaxWarnings = 100;       // kept with a job
inline constexpr std::size_t kMaxNameBytes = 256;      // of a job or worker
inline constexpr std::size_t kMaxJobs = 100'000;       // frames count, each
inline constexpr std::size_t kMaxJobsOfUser = 25'000;  // of those
using ls::kMaxFramePixels;
using ls::kMaxFrameSide;
using ls::kMaxSpp;
inline constexpr double kMaxTimeSeconds = 365.0 * 86400;
inline constexpr int kMaxPriority = 1'000'000;

// ---- sequences (how many frames: common/base/frame_range.h) ----
inline constexpr std::size_t kMaxSequenceText = std::size_t{512} << 20;     // read for all frames together
inline constexpr std::uint64_t kMaxSequenceTiles = std::uint64_t{1} << 24;  // 24 bytes each from the start
inline constexpr std::size_t kMaxSequenceFiles = std::size_t{1} << 20;      // named by all frames together
inline constexpr std::uint64_t kMaxWokenPixels = std::uint64_t{1}
                                                 << 26;  // of done frames that are extended at once
inline constexpr std::size_t kFramesPerEvent = 2500;     // a sequence of more tells of itself less often

// ---- results ----
inline constexpr std::uint64_t kMaxSegmentBytes = std::uint64_t{64} << 20;  // one partials-NNN.seg
inline constexpr std::uint32_t kMaxSegments = 1u << 20;
// Of all jobs together. With them an UHD film of 8.3 million pixels, 48 bytes each, stays below 600 MB.
inline constexpr std::size_t kMaxResultsWaiting = std::size_t{32}
                                                  << 20;  // bytes not yet durable; then streams are not read
inline constexpr std::size_t kMaxPendingPartials = std::size_t{32}
                                                   << 20;  // decoded, waiting for an earlier round; then
                                                           // they are read again from the segments
inline constexpr std::size_t kMaxCommitBatch = 256;        // results that share one fdatasync
inline constexpr int kVerifyThreads = 2;

// ---- workers ----
inline constexpr std::size_t kMaxWorkers = 16'384;
inline constexpr std::size_t kMaxTags = 64;

// ---- snapshots: whichever comes first ----
inline constexpr std::uint64_t kSnapshotUnits = 8192;  // folded since the last: about 2 s of folding again
inline constexpr double kSnapshotSeconds = 60;

// ---- events ----
inline constexpr std::size_t kEventsKept = 16'384;
inline constexpr std::uint64_t kEventIdBlock = 1'000'000;  // reserved on disk at once
inline constexpr double kProgressSeconds = .25;            // between two progress events of one job
inline constexpr std::size_t kLogLinesKept = 10'000;       // per job

}  // namespace ls::coordinator::limits
