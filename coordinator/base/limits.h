// All limits of the coordinator's service, store and assembler. A constant kMax... is the largest value
// allowed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/clock.h"
#include "common/image/frame/render_limits.h"

namespace ls::coordinator::limits {

// Blobs

// Bytes of one file of a scene: 64 GiB
inline constexpr std::uint64_t kMaxBlobBytes = std::uint64_t{1} << 36;
inline constexpr std::uint64_t kMaxBlobRead = std::uint64_t{256} << 20;  // bytes that one read() returns
// Interrupted uploads that are kept so that they can be resumed
inline constexpr std::size_t kMaxUnfinishedUploads = 1024;
// Time between two checks for blobs that are missing: a job is paused while a blob that it needs is missing
inline constexpr Duration kMissingBlobLook = std::chrono::seconds(1);

// Submission
inline constexpr std::size_t kMaxAssets = 100'000;  // files that one submission may name
inline constexpr std::size_t kMaxWarnings = 100;    // warnings kept per job
// Longer names of jobs and workers are cut to this many bytes
inline constexpr std::size_t kMaxShownName = 256;
inline constexpr std::size_t kMaxJobs = 100'000;       // jobs kept; every frame of a sequence counts as one
inline constexpr std::size_t kMaxJobsOfUser = 25'000;  // jobs of one user, of the kMaxJobs
using ls::kMaxFramePixels;
using ls::kMaxFrameSide;
using ls::kMaxSpp;

// Sequences (the limit on the number of frames is in common/base/frame_range.h)

// Bytes of scene text read for all frames together
inline constexpr std::size_t kMaxSequenceText = std::size_t{512} << 20;
// Tiles of all frames together; each takes 24 bytes of memory from the start
inline constexpr std::uint64_t kMaxSequenceTiles = std::uint64_t{1} << 24;
inline constexpr std::size_t kMaxSequenceFiles = std::size_t{1} << 20;  // asset files of all frames together
// A change of a sequence may resume finished frames with at most this many pixels in total
inline constexpr std::uint64_t kMaxWokenPixels = std::uint64_t{1} << 26;
// The more frames a sequence has, the fewer progress events it sends: with N frames at most one every
// kProgressSeconds * (1 + N / kFramesPerEvent) seconds. Up to this many frames, the events that follow
// submissions and commands of users are sent without delay
inline constexpr std::size_t kFramesPerEvent = 2500;

// Pictures and videos
inline constexpr double kMaxExposure = 32;  // stops, positive or negative
inline constexpr double kMinVideoFps = 1, kMaxVideoFps = 120;
inline constexpr int kMaxVideoSide = 3840;  // pixels; larger images are halved until they fit
inline constexpr std::uint64_t kMaxVideoBytes = std::uint64_t{2} << 30;
inline constexpr std::size_t kMaxVideosWaiting = 8;               // videos that wait while one is made
inline constexpr Duration kMaxVideoTime = std::chrono::hours(1);  // time to make one video
// ffmpeg is killed when it takes no pixels, or does not end after the last ones, for this long
inline constexpr Duration kVideoStallLimit = std::chrono::minutes(2);

// Results. A partial is the encoded result of one unit (one round of one tile). The limits in bytes apply to
// all jobs together. They are chosen so that the coordinator needs less than 600 MB of memory for a job with
// a UHD film (8.3 million pixels at 48 bytes each) and some tens of workers.

// Bytes of one partials-NNN.seg file, a segment of a job's log of partials
inline constexpr std::uint64_t kMaxSegmentBytes = std::uint64_t{64} << 20;
inline constexpr std::uint32_t kMaxSegments = 1u << 20;
// Bytes of results that are received but not durable yet; above this, the coordinator does not read from its
// workers
inline constexpr std::size_t kMaxResultsWaiting = std::size_t{32} << 20;
// Bytes of decoded partials that wait for an earlier round of their tile; above this, partials are dropped
// from memory and read from the segments when they are needed
inline constexpr std::size_t kMaxPendingPartials = std::size_t{32} << 20;
inline constexpr std::size_t kMaxCommitBatch = 256;  // results made durable by one fdatasync
inline constexpr int kVerifyThreads = 2;

// Workers
inline constexpr std::size_t kMaxWorkers = 16'384;

// Snapshots of a job's image. A snapshot is taken when kSnapshotUnits units have been added to the image
// since the previous one, or when kSnapshotSeconds have passed. Adding that many units again after a crash
// takes about 2 s
inline constexpr std::uint64_t kSnapshotUnits = 8192;
inline constexpr double kSnapshotSeconds = 60;

// Events
inline constexpr std::size_t kEventsKept = 16'384;
// Ids of events that are reserved on disk in one step
inline constexpr std::uint64_t kEventIdBlock = 1'000'000;
inline constexpr double kProgressSeconds = .25;       // least seconds between two progress events of one job
inline constexpr std::size_t kLogLinesKept = 10'000;  // log lines kept per job

}  // namespace ls::coordinator::limits
