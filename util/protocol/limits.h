// All size limits of the worker protocol: largest values, in bytes where the name ends in Bytes. Coordinator
// and worker keep to them when they send, and check received data against them before they allocate or store
// anything.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/image/frame/render_limits.h"

namespace ls::limits {

inline constexpr std::size_t kMessageBytes = 1 << 20;  // largest size of one gRPC message
// Largest size of an encoded partial: the pixel sums of one unit. A partial is sent in a UnitResult message,
// so 32 KiB are left for the other fields. Without AOVs a partial has 6 floats per pixel, which allows tiles
// of about 200 x 200 pixels.
inline constexpr std::size_t kPartialBytes = kMessageBytes - (32 << 10);
inline constexpr std::size_t kBlobChunkBytes = 256 << 10;

inline constexpr std::size_t kIdBytes = 64;  // length of an id of a job, lease or worker
// Length of the name of a worker, asset, tag or build, and of WorkerProgress::activity.
inline constexpr std::size_t kNameBytes = 128;
// Length of a text that gives the reason of a failure or describes a problem.
inline constexpr std::size_t kTextBytes = 4096;
// Length of the reason of a returned lease, which the coordinator keeps for each worker and job. A longer one
// is cut.
inline constexpr std::size_t kReasonBytes = 256;
inline constexpr std::size_t kTokenBytes = 512;
inline constexpr std::size_t kSettingsBytes = 64 << 10;
inline constexpr std::size_t kNeedsBytes = 16 << 10;

// Times in milliseconds. When a connection has been silent for kKeepaliveMs, either side sends a ping. If no
// answer comes within kKeepaliveTimeoutMs, it closes the connection. So a lost peer is noticed within 30 s.
inline constexpr int kKeepaliveMs = 20'000, kKeepaliveTimeoutMs = 10'000;

inline constexpr std::size_t kUnitsPerLease = 4096;
inline constexpr std::size_t kLeasesPerWorker = 1024;
inline constexpr std::size_t kAssetsPerJob = 4096;
inline constexpr std::size_t kTags = 64;
inline constexpr std::size_t kBlobsHeld = 8192;
inline constexpr int kThreads = 4096;
// A worker keeps the worlds (scenes made ready to render) of at most this many jobs in memory: that of the
// job being rendered and that of the next one, so that its threads need not wait between two jobs.
inline constexpr std::size_t kWorldsKept = 2;
// Longest duration, in seconds, that a worker may report. The limit keeps sums of durations finite.
inline constexpr double kSeconds = 1e12;

inline constexpr int kFrameSide = kMaxFrameSide;  // pixels
inline constexpr std::uint64_t kSampleIndex = kMaxSpp;

}  // namespace ls::limits
