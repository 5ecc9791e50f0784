// All limits of the coordinator's service, store and assembler.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/clock.h"
#include "common/image/frame/render_limits.h"

namespace ls::coordinator::limits {

// Blobs
inline constexpr std::uint64_t kMaxBlobBytes = std::uint64_t{1} << 36;   // one file of a scene: 64 GiB
inline constexpr std::uint64_t kMaxBlobRead = std::uint64_t{256} << 20;  // in one read()
inline constexpr std::size_t kMaxUnfinishedUploads = 1024;  // interrupted uploads kept for resuming
inline constexpr std::uint64_t kMaxIncludeBytes = std::uint64_t{32} << 20;
// Time between two checks for blobs that jobs are waiting for
inline constexpr Duration kMissingBlobLook = std::chrono::seconds(1);

// Submission
inline constexpr std::size_t kMaxSceneText = std::size_t{32} << 20;
inline constexpr std::size_t kMaxAssets = 100'000;     // per request
inline constexpr std::size_t kMaxWarnings = 100;       // kept per job
inline constexpr std::size_t kMaxShownName = 256;      // of a job or worker
inline constexpr std::size_t kMaxJobs = 100'000;       // every frame of a sequence counts as one
inline constexpr std::size_t kMaxJobsOfUser = 25'000;  // the part of kMaxJobs that one user may have
using ls::kMaxFramePixels;
using ls::kMaxFrameSide;
using ls::kMaxSpp;
inline constexpr double kMaxTimeSeconds = 365.0 * 86400;

// Sequences (the limit on frames is in common/base/frame_range.h)

// Scene text read for all frames together
inline constexpr std::size_t kMaxSequenceText = std::size_t{512} << 20;
// Tiles of all frames together; each takes 24 bytes from the start
inline constexpr std::uint64_t kMaxSequenceTiles = std::uint64_t{1} << 24;
inline constexpr std::size_t kMaxSequenceFiles = std::size_t{1} << 20;  // asset files of all frames together
// Pixels of the finished frames that one extension reopens at once
inline constexpr std::uint64_t kMaxWokenPixels = std::uint64_t{1} << 26;
inline constexpr std::size_t kFramesPerEvent = 2500;  // longer sequences send progress events less often

// Results. The limits in bytes hold for all jobs together; with them a UHD film of 8.3 million pixels at 48
// bytes each stays below 600 MB.
inline constexpr std::uint64_t kMaxSegmentBytes = std::uint64_t{64} << 20;  // one partials-NNN.seg file
inline constexpr std::uint32_t kMaxSegments = 1u << 20;
// Bytes received but not yet durable; above this, worker streams are not read
inline constexpr std::size_t kMaxResultsWaiting = std::size_t{32} << 20;
// Bytes decoded and waiting for an earlier round; above this, partials are dropped from memory and read again
// from the segments
inline constexpr std::size_t kMaxPendingPartials = std::size_t{32} << 20;
inline constexpr std::size_t kMaxCommitBatch = 256;  // results written with one fdatasync
inline constexpr int kVerifyThreads = 2;

// Workers
inline constexpr std::size_t kMaxWorkers = 16'384;
inline constexpr std::size_t kMaxTags = 64;

// Snapshots: taken after kSnapshotUnits units folded since the last one (folding these again takes about 2 s)
// or after kSnapshotSeconds
inline constexpr std::uint64_t kSnapshotUnits = 8192;
inline constexpr double kSnapshotSeconds = 60;

// Events
inline constexpr std::size_t kEventsKept = 16'384;
inline constexpr std::uint64_t kEventIdBlock = 1'000'000;  // ids reserved on disk at once
inline constexpr double kProgressSeconds = .25;       // least time between two progress events of one job
inline constexpr std::size_t kLogLinesKept = 10'000;  // per job

}  // namespace ls::coordinator::limits
