// False-colour maps of where an image's error stands and where its samples went.
//
// One scale for both, as a ramp from dark blue over green to yellow, in steps of equal factors:
//   error: each pixel's relative standard error, sqrt of the mean over channels of d w (error_estimate.h),
//     averaged over 3 x 3 pixels of its tile: a single pixel's difference of two halves says little. 10^-3
//     and less is the lowest colour, 1 and more the highest: three decades.
//   samples: per pixel, 2 is the lowest colour, 2^14 the highest: thirteen doublings.
// Magenta in the map of errors: pixels with too few hits (error_estimate.h). Tiles without a sample are grey.
// The maps have the image's size, so that they can be laid over it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/error.h"
#include "common/image/film.h"

namespace ls {

inline constexpr double kMapLeastError = 1e-3, kMapMostError = 1;       // relative standard error
inline constexpr double kMapLeastSamples = 2, kMapMostSamples = 16384;  // per pixel

// 0..1 to a colour; darker is less, in lightness alone, too (for who sees no hues).
std::array<std::uint8_t, 3> map_colour(double t);
inline constexpr std::array<std::uint8_t, 3> kFewHitsColour = {255, 0, 255}, kNoSampleColour = {96, 96, 96};

Result<std::vector<std::byte>> error_map_png(const Film& film);
Result<std::vector<std::byte>> samples_map_png(const Film& film);

}  // namespace ls
