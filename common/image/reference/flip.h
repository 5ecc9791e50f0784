// FLIP: visibility of the difference of two images to a viewer who flips between them, from 0 (invisible) to
// 1.
//
//   [LDR] Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom, Fairchild 2020, "FLIP: A Difference
//         Evaluator for Alternating Images", HPG (equations (1) to (14) there).
//   [HDR] Andersson, Nilsson, Shirley, Akenine-Moeller 2021, "Visualizing Errors in Rendered High
//         Dynamic Range Images", Eurographics short papers: LDR-FLIP of both images tone-mapped at several
//         exposures; each pixel keeps the largest of these errors; the exposures follow from the reference
//         alone.
//
// Pixels are linear with Rec. 709 primaries, R, G, B interleaved, row by row. Beyond the edge the nearest
// pixel is repeated. Values are single precision; sums have a fixed order, so that the same images give the
// same number.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/image/frame/frame.h"

namespace ls {

// Pixels per degree on a 0.7 m wide monitor of 3,840 pixels, seen from 0.7 m: 0.7 * 3840 / 0.7 * pi / 180.
inline constexpr float kFlipPixelsPerDegree = 67.0206432765823F;

struct FlipImage {
  FrameSize size;
  std::span<const float> rgb;
};

// Returns the error of each pixel on a display that shows `rgb`, clamped to 0..1. Both images must have the
// same size.
std::vector<float> ldr_flip(const FlipImage& reference, const FlipImage& image,
                            float pixels_per_degree = kFlipPixelsPerDegree);

// The exposures of HDR-FLIP in stops ([HDR] section 4): `count` evenly spaced ones from `first`, which maps
// the brightest pixel of the reference to 0.85, to `last`, which maps the median to 0.85.
struct FlipExposures {
  float first = 0, last = 0;
  int count = 2;
  float at(int i) const {
    return first + (last - first) * static_cast<float>(i) / static_cast<float>(count - 1);
  }
};
FlipExposures flip_exposures(std::span<const float> reference_rgb);

// Returns the error of each pixel, the maximum over all exposures. Negative and non-finite values count as 0.
std::vector<float> hdr_flip(const FlipImage& reference, const FlipImage& image,
                            float pixels_per_degree = kFlipPixelsPerDegree);

// Returns the mean over pixels, which is usually quoted as the error
double mean_of(std::span<const float> values);

}  // namespace ls
