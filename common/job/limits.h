// Limits of a job. Exceeding one is an error that names the limit.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/frame/render_limits.h"

namespace ls {

inline constexpr int kMinTile = 8, kMaxTile = 256;  // pixels per side
// Largest number of units of a job: tiles times rounds (ranges of samples). One small tile may have 2^24
// samples per pixel (262 thousand rounds), a whole frame may not.
inline constexpr std::uint64_t kMaxUnits = std::uint64_t{1} << 26;
// Largest size of a film's sums in bytes: all AOVs of a UHD frame take about 5 GB, colour alone of the
// largest frame 3.2 GB.
inline constexpr std::uint64_t kMaxFilmBytes = std::uint64_t{8} << 30;
inline constexpr double kMaxSeconds = 365.0 * 86400;  // longest time budget
inline constexpr double kMaxTargetError = 1e6;
inline constexpr int kMaxPriority = 1'000'000;  // largest absolute value of a priority
// Largest size in bytes of the text of a spec or of settings
inline constexpr std::size_t kMaxSpecBytes = std::size_t{1} << 20;
// Largest value of a job's own limits, JobSpec::max_workers and max_units.
inline constexpr std::uint64_t kMaxAtOnce = 1'000'000;
// Largest memory, in bytes, that a job may require of a worker.
inline constexpr std::uint64_t kMaxMemory = std::uint64_t{1} << 50;
inline constexpr std::size_t kMaxNames = 64;  // largest number of names in `aov` and in `tags`
inline constexpr std::size_t kMaxNameBytes = 64;
inline constexpr std::size_t kMaxDefines = 1024, kMaxDefineBytes = 65536;

}  // namespace ls
