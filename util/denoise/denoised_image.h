// The denoised image of a film, and its error.
//
// The two halves A and B of the samples are independent and have the same expectation R, the true image. Each
// half is denoised separately, with its own guides (albedo and normals); the denoised image is the mean D =
// (D(A) + D(B)) / 2. Let a and b be the noise of A and B, and x and y the errors of D(A) and D(B) (bias,
// blur, remaining noise). x depends on a alone and y on b alone. Per pixel and channel
//
//   (A - D(A)) (B - D(B)) = (a - x) (b - y) = a b - x b - a y + x y,
//
// where a b, x b and a y have the expectation 0. So this product of the two residuals has the expectation of
// x y. With D(A) - D(B) = x - y,
//
//   (A - D(A)) (B - D(B)) + (D(A) - D(B))^2 / 4  has the expectation of  ((x + y) / 2)^2,
//
// the squared error of D, for every denoiser. The product measures the errors that the denoiser makes in both
// halves, the difference those that it makes in only one. Relative errors have the weight f(D) = 1 / (D^2 +
// 0.01). This weight depends on D and so on the noise. To first order in the noise, this changes the relative
// error by
//
//   -bias f' s Var,
//
// with `bias` the mean error of the denoiser, f' the derivative of the weight, s the share of a pixel's own
// noise that remains in its denoised value, and Var the variance of the noise of one half. So the relative
// error is too low where the denoiser darkens, too high where it brightens, and nearly right where s is
// small.
//
// Interval: the estimate differs from the realised squared error by n = a b - x b - a y. This n is nearly
// uncorrelated between pixels: a pixel contributes only little to its neighbours' denoised values. If a share
// s of a pixel's own noise remains in its denoised value, so that x = s a and y = s b, then
//
//   n = (1 - 2 s) a b = (1 - s)^2 a b - s^2 a b.
//
// The two terms of this difference have the same sign, so its square is at most the sum of their squares. The
// first term is the product of the residuals. The second cannot be measured, but its square has the
// expectation s^4 Var^2. For Gaussian noise (D(A) - D(B))^4 / 12 has the same expectation, since E (a - b)^4
// = 12 Var^2; with heavier tails it has a larger one. So the squared product plus (D(A) - D(B))^4 / 12 is, in
// the mean, at least n^2; bias increases it and makes the interval wider. Channels are summed before they are
// squared, since they share paths. No interval is given if the number of pixels that carry the noise, (sum
// n^2)^2 / sum n^4, is below four: the variance of a single pixel cannot be estimated from one pair of
// halves.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image/film/film.h"
#include "util/denoise/denoiser.h"

namespace ls {

// Means over the pixels that have samples, and 95 % intervals. The mean squared errors are estimates, which
// noise can make negative. The lower ends of intervals are at least 0, and rmse is the square root of max(0,
// mse).
struct DenoisedError {
  double mse = 0, rmse = 0, rmse_lo = 0, rmse_hi = 0;
  double relmse = 0, relmse_lo = 0, relmse_hi = 0;
  bool rmse_interval = false, relmse_interval = false;  // false: the interval is unknown
  // Returns the upper end of the interval of relMSE; nullopt: there is no interval. A negative estimate means
  // that its noise is larger than the error. In this case the interval is moved up so that its centre is 0.
  std::optional<double> relmse_at_most() const {
    return relmse_interval ? std::optional(relmse_hi - std::min(0.0, relmse)) : std::nullopt;
  }
};

// The mean images of the two halves, and the denoised images of these means: R, G, B of each pixel, row by
// row. `counts` has one element per pixel: false if the pixel has no samples.
struct DenoisedHalves {
  std::vector<float> a, b, denoised_a, denoised_b;
  std::vector<bool> counts;
};
DenoisedError denoised_error(const DenoisedHalves& halves);

struct DenoisedImage {
  FrameSize size;
  std::vector<float> rgb;  // R, G, B of each pixel, row by row; 0 where there are no samples
  DenoisedError error;
  std::string by;  // name of the denoiser, from Denoiser::name()
};
// Denoises a film, which may be unfinished. It must have all AOVs of AovKind::guide. Returns the errors of
// Denoiser::denoise().
Result<DenoisedImage> denoised_image(const Film& film, const Denoiser& denoiser);

}  // namespace ls
