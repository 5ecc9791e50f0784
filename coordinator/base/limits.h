// All limits of the coordinator's service, store and assembler. A constant kMax... is the largest value
// allowed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/clock.h"
#include "core/image/frame/render_limits.h"

namespace ls::coordinator::limits {

// Blobs: the files of scenes, stored by their SHA-256

// Size of one file of a scene, in bytes: 64 GiB
inline constexpr std::uint64_t kMaxBlobBytes = std::uint64_t{1} << 36;
// Bytes that one BlobStore::read() returns
inline constexpr std::uint64_t kMaxBlobRead = std::uint64_t{256} << 20;
// Number of interrupted uploads that are kept so that they can be resumed. If there are more, the one that
// has not grown for the longest time is removed
inline constexpr std::size_t kMaxUnfinishedUploads = 1024;
// A job is paused while a blob that it needs is missing. This is the time between two checks whether missing
// blobs have arrived
inline constexpr Duration kMissingBlobLook = std::chrono::seconds(1);
// If the files of a job cannot be written at its end (the disk is full), this is the time until the next
// attempt
inline constexpr Duration kWriteAgain = std::chrono::seconds(10);

// Workers
inline constexpr std::size_t kWorkerLogLines = 40;   // events that are kept in memory for each worker
inline constexpr std::size_t kWorkerLogBytes = 256;  // largest size of the text of an event

// Submission
inline constexpr std::size_t kMaxAssets = 100'000;  // files that one submission may name
inline constexpr std::size_t kMaxWarnings = 100;    // warnings kept per job
// Longer names of jobs and workers are cut to this many bytes
inline constexpr std::size_t kMaxShownName = 256;
inline constexpr std::size_t kMaxJobs = 100'000;       // jobs kept; every frame of a sequence counts as one
inline constexpr std::size_t kMaxJobsOfUser = 25'000;  // of these jobs, one user may own this many
// Of a sequence so many frames count in the memory for images (Coordinator::Options::film_bytes)
inline constexpr std::size_t kFilmsOfSequence = 4;
// Memory that reading one byte of a scene's text takes at most: for spheres, 207 bytes here and 82 in the
// process that reads the text were measured
inline constexpr std::uint64_t kMemoryPerTextByte = 320;
inline constexpr std::uint64_t kMemoryOfReference = std::uint64_t{1}
                                                    << 30;  // while one is decoded and checked
// Memory that reading the scenes of all submissions may take at the same time; half of it for one user
inline constexpr std::uint64_t kAdmissionBytes = std::uint64_t{8} << 30;
// Submissions that are read at the same time; of one user, one
inline constexpr std::size_t kAdmissions = 8;
using ls::kMaxFramePixels;
using ls::kMaxFrameSide;
using ls::kMaxSpp;

// Sequences (the limit on the number of frames is in core/base/frame_range.h)

// Bytes of scene text read for all frames together
inline constexpr std::size_t kMaxSequenceText = std::size_t{512} << 20;
// Tiles of all frames together; each tile takes 24 bytes of memory from submission on
inline constexpr std::uint64_t kMaxSequenceTiles = std::uint64_t{1} << 24;
// Files used by the scenes of all frames, in total
inline constexpr std::size_t kMaxSequenceFiles = std::size_t{1} << 20;
// One command that changes a sequence (more samples, a smaller target error) may resume done frames with at
// most this many pixels in total
inline constexpr std::uint64_t kMaxWokenPixels = std::uint64_t{1} << 26;
// The more frames a sequence has, the fewer progress events it sends: with N frames, at most one every
// kProgressSeconds * (1 + N / kFramesPerEvent) seconds. If N is at most kFramesPerEvent, the events that
// follow submissions and commands of users are exempt: they are sent at once
inline constexpr std::size_t kFramesPerEvent = 2500;

// Pictures and videos
inline constexpr double kMaxExposure = 32;  // photographic stops, brighter or darker
inline constexpr double kMinVideoFps = 1, kMaxVideoFps = 120;
inline constexpr int kMaxVideoSide = 3840;  // pixels; larger images are halved until they fit
inline constexpr std::uint64_t kMaxVideoBytes = std::uint64_t{2} << 30;
inline constexpr std::size_t kMaxVideosWaiting = 8;  // videos that may wait while another is made
inline constexpr Duration kMaxVideoTime = std::chrono::hours(1);  // time for making one video
// ffmpeg, which encodes a video, is killed if for this long it accepts no more pixels, or does not end after
// the last ones
inline constexpr Duration kVideoStallLimit = std::chrono::minutes(2);

// Results. A partial is the encoded result of one unit. The limits in bytes apply to all jobs together. They
// are chosen so that the coordinator needs less than 600 MB of memory for a job with a UHD film (8.3 million
// pixels at 48 bytes each) and some tens of workers.

// Bytes of one partials-NNN.seg file, a segment of a job's log of partials
inline constexpr std::uint64_t kMaxSegmentBytes = std::uint64_t{64} << 20;
inline constexpr std::uint32_t kMaxSegments = 1u << 20;
// Bytes of results that have arrived but are not durable yet. Above this, the coordinator reads no more
// messages from its workers until some of these results are durable
inline constexpr std::size_t kMaxResultsWaiting = std::size_t{32} << 20;
// Bytes of decoded partials in memory that wait for an earlier round of their tile. Above this, further
// waiting partials are dropped from memory, and read from the segments when they are needed
inline constexpr std::size_t kMaxPendingPartials = std::size_t{32} << 20;
inline constexpr std::size_t kMaxCommitBatch = 256;  // results made durable by one fdatasync
inline constexpr int kVerifyThreads = 2;

// Workers
inline constexpr std::size_t kMaxWorkers = 16'384;

// Snapshots of a job's image. A snapshot is taken when kSnapshotUnits units have been added to the image
// since the previous one, or after kSnapshotSeconds seconds. After a crash, the units that the latest
// snapshot lacks are added again, which takes about 2 s for kSnapshotUnits units
inline constexpr std::uint64_t kSnapshotUnits = 8192;
inline constexpr double kSnapshotSeconds = 60;

// Events
inline constexpr std::size_t kEventsKept = 16'384;
// Event ids are reserved on disk in blocks of this many
inline constexpr std::uint64_t kEventIdBlock = 1'000'000;
inline constexpr double kProgressSeconds = .25;       // least seconds between two progress events of one job
inline constexpr std::size_t kLogLinesKept = 10'000;  // log lines kept per job

}  // namespace ls::coordinator::limits
