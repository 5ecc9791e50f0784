// Limits of an image, shared by scenes, jobs, the protocol and the coordinator, so that none of them rejects
// what another accepts.
#pragma once

#include <cstdint>

namespace ls {

inline constexpr int kMaxFrameSide = 32768;  // pixels
// 67 million pixels; the film's sums then take 3.2 GB.
inline constexpr std::int64_t kMaxFramePixels = std::int64_t{1} << 26;
inline constexpr std::uint32_t kMaxTiles = std::uint32_t{1} << 22;
inline constexpr std::uint64_t kMaxSpp = std::uint64_t{1} << 24;
inline constexpr int kMaxDepthSetting = 1 << 20;  // limit of max_depth and rr_depth
inline constexpr int kMaxCameraPoints = 64;       // limit of camera_points

}  // namespace ls
