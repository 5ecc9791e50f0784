// FLIP is an error metric: how visible the difference of two images is to a viewer who flips between them,
// from 0 (invisible) to 1.
//
//   [LDR] Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom, Fairchild 2020, "FLIP: A Difference
//         Evaluator for Alternating Images", HPG (equations (1) to (14) there).
//   [HDR] Andersson, Nilsson, Shirley, Akenine-Moeller 2021, "Visualizing Errors in Rendered High
//         Dynamic Range Images", Eurographics short papers: LDR-FLIP of both images tone-mapped at several
//         exposures; each pixel keeps the largest of these errors; the exposures follow from the reference
//         alone.
//
// Pixels are linear with Rec. 709 primaries, R, G, B interleaved, row by row. Filters repeat the nearest
// pixel beyond the edge of the image. Computations are in single precision, and sums have a fixed order, so
// that the same images always give the same number.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/image/frame/frame.h"

namespace ls {

// Pixels per degree on a 0.7 m wide monitor of 3,840 pixels, seen from 0.7 m: 0.7 * 3840 / 0.7 * pi / 180.
inline constexpr float kFlipPixelsPerDegree = 67.0206432765823F;

struct FlipImage {
  FrameSize size;
  std::span<const float> rgb;
};

// Returns the LDR-FLIP error of each pixel. The values of `rgb` are clamped to [0, 1], as by a display. Both
// images must have the same size.
std::vector<float> ldr_flip(const FlipImage& reference, const FlipImage& image,
                            float pixels_per_degree = kFlipPixelsPerDegree);

// The exposures of HDR-FLIP ([HDR] section 4): `count` evenly spaced values from `first` to `last`, in stops.
// `first` is the exposure at which the tone curve maps the brightest pixel of the reference to 0.85, `last`
// the one at which it maps the median luminance (of the pixels that are not black) to 0.85.
struct FlipExposures {
  float first = 0, last = 0;
  int count = 2;
  float at(int i) const {
    return first + (last - first) * static_cast<float>(i) / static_cast<float>(count - 1);
  }
};
FlipExposures flip_exposures(std::span<const float> reference_rgb);

// Returns the HDR-FLIP error of each pixel: the maximum of its LDR-FLIP errors at all exposures. Negative and
// non-finite values in `rgb` count as 0.
std::vector<float> hdr_flip(const FlipImage& reference, const FlipImage& image,
                            float pixels_per_degree = kFlipPixelsPerDegree);

// Returns the mean over all pixels, which is usually quoted as the FLIP error of an image; 0 if there are no
// values.
double mean_of(std::span<const float> values);

}  // namespace ls
