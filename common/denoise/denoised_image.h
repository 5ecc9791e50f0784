// The denoised image of a film, and its error.
//
// The two halves A and B of the samples are independent and have the same expectation R, the right image.
// Each is denoised by itself, with its own guides; the denoised image is the mean D = (D(A) + D(B)) / 2.
// Write a, b for the noise of A and B, and x, y for the errors of D(A) and D(B), whatever a denoiser does to
// them: bias, blur, left-over noise. x depends on a alone and y on b alone. Per pixel and channel
//
//   (A - D(A)) (B - D(B)) = (a - x) (b - y) = a b - x b - a y + x y,
//
// and a b, x b, a y have the expectation 0. So the product of the two residuals has that of x y. With
// D(A) - D(B) = x - y,
//
//   (A - D(A)) (B - D(B)) + (D(A) - D(B))^2 / 4  has the expectation of  ((x + y) / 2)^2,
//
// the squared error of D, for every denoiser. The residuals show what the denoiser did to both halves alike,
// the difference what it did to each. Relative errors are weighted by 1 / (D^2 + 0.01). To first order that
// is wrong by - x f' s Var, f' the derivative of the weight and s the share of a pixel's own noise in its
// denoised value: too low where the denoiser darkens, too high where it brightens, and little where s is
// small.
//
// Interval: the estimate misses the realised squared error by n = a b - x b - a y, which is uncorrelated
// between pixels but for the little that a pixel contributes to its neighbours' denoised values. With a share
// s of a pixel's own noise left in it, x = s a and y = s b, n is (1 - 2 s) a b = (1 - s)^2 a b - s^2 a b. The
// first term is the product of the residuals. The second is as large as (D(A) - D(B))^2 / sqrt(12) in the
// mean square (E (a - b)^4 = 12 Var^2 for Gaussian noise, more for heavier tails). So the sum of both squares
// is at least n^2 in the mean; what bias adds to it makes the interval wider, too. Channels are summed before
// they are squared, since they share paths. Where fewer than four pixels carry all of it, (sum n^2)^2 / sum
// n^4, there is no interval: the right variance of a single pixel cannot be told from one pair of halves.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/denoise/denoiser.h"
#include "common/image/film/film.h"

namespace ls {

// Means over the pixels that have samples, and 95 % intervals. The mean squared errors are estimates that
// noise can bring below 0; lower ends are at least 0, and rmse is that of max(0, mse).
struct DenoisedError {
  double mse = 0, rmse = 0, rmse_lo = 0, rmse_hi = 0;
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  bool rmse_interval = false, relmse_interval = false;  // false: the interval is not known
};

// Half means and their denoised images, all interleaved RGB, row by row. `counts` is false where a pixel has
// no samples.
struct DenoisedHalves {
  std::vector<float> a, b, denoised_a, denoised_b;
  std::vector<bool> counts;
};
DenoisedError denoised_error(const DenoisedHalves& halves);

struct DenoisedImage {
  FrameSize size;
  std::vector<float> rgb;  // interleaved, row by row; 0 where there are no samples
  DenoisedError error;
  std::string by;  // Denoiser::name()
};
// Denoises a film, also an unfinished one, that has the AOVs aovs_of(AovKind::guide). Errors are those of
// Denoiser.
Result<DenoisedImage> denoised_image(const Film& film, const Denoiser& denoiser);

}  // namespace ls
