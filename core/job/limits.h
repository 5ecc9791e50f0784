// Limits of a job. Exceeding one is an error that names the limit.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/image/frame/render_limits.h"

namespace ls {

inline constexpr int kMinTile = 8, kMaxTile = 256;  // pixels per side
// Largest number of units of a job: its number of tiles times its number of rounds (ranges of samples). For
// 2^24 samples per pixel, the largest number, a tile needs 262 thousand rounds, so only images of at most 255
// tiles may have that many samples.
inline constexpr std::uint64_t kMaxUnits = std::uint64_t{1} << 26;
// Largest memory, in bytes, of the pixel sums of a job's image. For comparison: a UHD frame with all AOVs
// takes about 5 GB, the largest frame without AOVs 3.2 GB.
inline constexpr std::uint64_t kMaxFilmBytes = std::uint64_t{8} << 30;
inline constexpr double kMaxSeconds = 365.0 * 86400;  // longest time budget: a year
inline constexpr double kMaxTargetError = 1e6;
inline constexpr double kMaxFps = 1000;         // frames per second of a sequence
inline constexpr int kMaxPriority = 1'000'000;  // largest absolute value of a priority
// Largest size, in bytes, of the JSON text of a JobSpec or of RenderSettings (settings.h).
inline constexpr std::size_t kMaxSpecBytes = std::size_t{1} << 20;
// Largest value of JobSpec::max_workers and JobSpec::max_units, by which a job limits how many workers and
// units it uses at the same time.
inline constexpr std::uint64_t kMaxAtOnce = 1'000'000;
// Largest memory, in bytes, that a job may require of a worker.
inline constexpr std::uint64_t kMaxMemory = std::uint64_t{1} << 50;
inline constexpr std::size_t kMaxNames = 64;  // largest number of names in `aov` and in `tags`
inline constexpr std::size_t kMaxNameBytes = 64;
inline constexpr std::size_t kMaxDefines = 1024, kMaxDefineBytes = 65536;

}  // namespace ls
