// Limits of an image, shared by scenes, jobs, the protocol and the coordinator, so that none of them rejects
// what another accepts.
#pragma once

#include <cstdint>

namespace ls {

inline constexpr int kMaxFrameSide = 32768;  // pixels
// 67 million pixels. The colour sums of the film then take 3.2 GB: six doubles (48 bytes) per pixel.
inline constexpr std::int64_t kMaxFramePixels = std::int64_t{1} << 26;
inline constexpr std::uint32_t kMaxTiles = std::uint32_t{1} << 22;
inline constexpr std::uint64_t kMaxSpp = std::uint64_t{1} << 24;
// Largest value of the integrator settings max_depth and rr_depth.
inline constexpr int kMaxDepthSetting = 1 << 20;
inline constexpr int kMaxMeters = 100'000;   // numbers that one scene measures
inline constexpr int kMaxCameraPoints = 64;  // largest value of the integrator setting camera_points

}  // namespace ls
