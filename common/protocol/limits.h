// All size limits of the worker protocol. Coordinator and worker keep to them when they send, and check
// received data against them before they allocate or store anything.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/frame/render_limits.h"

namespace ls::limits {

inline constexpr std::size_t kMessageBytes = 1 << 20;  // size of one gRPC message
// Largest encoded partial (the pixel sums of one unit, which is one tile and one range of samples). With 6
// floats per pixel this allows tiles of about 200 x 200 pixels; 32 KiB are left for the rest of the
// UnitResult message.
inline constexpr std::size_t kPartialBytes = kMessageBytes - (32 << 10);
inline constexpr std::size_t kBlobChunkBytes = 256 << 10;

inline constexpr std::size_t kIdBytes = 64;  // length of the ids of jobs, leases and workers
// Length of the names of workers, assets, tags and builds, and of a worker's activity.
inline constexpr std::size_t kNameBytes = 128;
inline constexpr std::size_t kTextBytes = 4096;  // length of reasons of failures and descriptions of problems
inline constexpr std::size_t kTokenBytes = 512;
inline constexpr std::size_t kSettingsBytes = 64 << 10;
inline constexpr std::size_t kNeedsBytes = 16 << 10;

// Both sides ping a connection that has been silent for the first time, and close it if there is no answer
// within the second. So a lost peer is noticed within 30 s.
inline constexpr int kKeepaliveMs = 20'000, kKeepaliveTimeoutMs = 10'000;

inline constexpr std::size_t kUnitsPerLease = 4096;
inline constexpr std::size_t kLeasesPerWorker = 1024;
inline constexpr std::size_t kAssetsPerJob = 4096;
inline constexpr std::size_t kTags = 64;
inline constexpr std::size_t kBlobsHeld = 8192;
inline constexpr int kThreads = 4096;
// Longest duration in seconds that a worker may report, so that sums of durations stay finite.
inline constexpr double kSeconds = 1e12;

inline constexpr int kFrameSide = kMaxFrameSide;  // pixels
inline constexpr std::uint64_t kSampleIndex = kMaxSpp;

}  // namespace ls::limits
