// False-colour maps of an image's error and of its sample counts.
//
// Both use the same ramp from dark blue over green to yellow, on a logarithmic scale:
//   error: each pixel's relative standard error. Its square is the mean over channels of D^2 / (S^2 + 0.01),
//     with D the standard error and S the value of the pixel. The square is averaged over 3 x 3 pixels of the
//     tile, because a single pixel's difference of two halves is unreliable.
//     An error of 10^-3 or less has the lowest colour, 1 or more the highest: three decades.
//   samples: 2 samples per pixel have the lowest colour, 2^14 the highest: thirteen doublings.
// Magenta in the error map: pixels with too few hits (error_estimate.h). Tiles without samples are grey. The
// maps have the image's size, so that they can be overlaid on it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/error.h"
#include "common/image/film/film.h"

namespace ls {

inline constexpr double kMapLeastError = 1e-3, kMapMostError = 1;       // relative standard error
inline constexpr double kMapLeastSamples = 2, kMapMostSamples = 16384;  // per pixel

// Maps t from 0 to 1 to a colour. Lightness increases with t, so that the map can be read without seeing
// hues.
std::array<std::uint8_t, 3> map_colour(double t);
inline constexpr std::array<std::uint8_t, 3> kFewHitsColour = {255, 0, 255}, kNoSampleColour = {96, 96, 96};

Result<std::vector<std::byte>> error_map_png(const Film& film);
Result<std::vector<std::byte>> samples_map_png(const Film& film);

}  // namespace ls
