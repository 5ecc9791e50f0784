// Computes the error of an image against a reference, a rendered image with much less noise. x is a value of
// the image, ref the same value of the reference:
//
//   mse    = mean over pixels and channels of (x - ref)^2 - s^2
//   relmse = mean of h ((x - ref)^2 - s^2)
//
// s is the standard error of ref, which the file of the reference has in the layers stderr.R, G, B
// (final_image.h). It is s = |A - B| / 2, where A and B are the means of the two halves of the samples of the
// reference, and ref = (A + B) / 2. So A and B are ref + s and ref - s, in unknown order. Let T be the true
// value, and a = A - T, b = B - T and e = x - T the errors of A, B and the image. Then
//
//   (x - ref)^2 - s^2 = (x - A) (x - B) = (e - a) (e - b).
//
// a and b are independent and have mean 0. So the expectation of this product is e^2, whatever the
// distribution of a and b. Let r = Var((a + b) / 2), the variance of ref. Then the variance of the product is
// 4 e^2 r + 4 r^2. Half of the term 4 r^2 is due to the noise of s^2, which estimates r from a single
// difference.
//
// The weight h makes the error relative. Let f(m) = 1 / (m^2 + 0.01), with second derivative f''. The obvious
// weight f(ref) would be biased: where a and b are both large, f(ref) is small and the product above is
// large. The bias of f(ref) times the product is f'' r^2, which is many times e^2 f if the reference is
// noisy. So h is the mean of f(A) and f(B). The product times f(A) has the expectation of (e^2 - e a) f(A),
// since b is independent of the rest and has mean 0. The part -e a f(A) averages out over an image whose
// errors have both signs. The part e^2 f(A) has the bias e^2 f'' r, because A is noisy. relative_weight()
// subtracts f'' r from f(A) to correct it; it takes r from the s^2 of the neighbouring pixels, which are
// independent of a. The remaining bias is of second order in r: for bright m, 60 r^2 / m^4 relative to the
// value.
//
// The standard errors of mse and relmse account for the noise of the reference only. Take a, b and e of a
// pixel as vectors over the channels, and let V be the covariance matrix of ref. The dot product of (e - a)
// and (e - b) has the variance 4 e'Ve + 4 tr V^2, where e' is the transpose of e. It is estimated as follows.
// Let d = x - ref and t = (A - B) / 2, so that s = |t| in each channel. For Gaussian noise ref and t are
// independent, so the mean of 4 (d . t)^2 is this variance. The signs of t are not stored, so d . t is
// replaced by the sum over the channels of |d| s, which is at least as large. If the noise is the same in all
// channels (grey), the result is exact. If it is independent and r is much larger than e^2, the standard
// error is a third too large: in units of r^2, the mean square of the sum is 3 + 6 (2 / pi)^2 instead of 3.
//
// If the file has no layers stderr.R, G, B, s is taken as 0, and the errors include an unknown amount of the
// reference's noise. If it has them, noise can make mse or relmse negative; the result is then set to 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/image/exr/exr_file.h"
#include "core/image/frame/frame.h"

namespace ls {

// Where a reference comes from: the strings lightshaft:scene (digest of the scene, in hexadecimal) and
// lightshaft:seed in the header of its file; empty if missing.
struct ReferenceOrigin {
  std::string scene, seed;
};
// True if the reference was rendered from this scene with this seed. An image with that scene and seed shares
// samples with the reference, and so a part of its noise. This part cancels in the difference, so the
// difference is not the true error of the image.
bool same_noise(const ReferenceOrigin& origin, const Digest& scene, std::uint64_t seed);
inline constexpr const char* kSameSeed =
    "the reference shares this job's seed: its noise is the same noise; render it with another --seed";

struct Reference {
  FrameSize size;
  std::vector<float> rgb;    // R, G, B of each pixel, row by row
  std::vector<float> error;  // standard error of each value; empty: unknown
  ReferenceOrigin origin = {};
};
// Reads a reference image. invalid_argument: it is not an image; its size is not `size`; a value is not
// finite; or a value in an error layer is negative or not finite. `name` is for messages.
Result<Reference> read_reference(std::span<const std::byte> exr, const std::string& name, FrameSize size,
                                 const ExrLimits& limits = {});

// The noise of a reference: `mse` is the mean of s^2, `relmse` the mean of h s^2; both are 0 if s is unknown.
struct ReferenceNoise {
  double mse = 0, relmse = 0;
};
ReferenceNoise noise_of(const Reference& reference);

struct TrueError {
  double rmse = 0, relmse = 0;
  // Standard errors of mse (rmse^2) and of relmse, due to the noise of the reference; nullopt: s is unknown.
  std::optional<double> mse_stderr = {}, relmse_stderr = {};
};
// Returns the errors of the image `rgb` (R, G, B of each pixel, of the reference's size) against the
// reference.
TrueError true_error(const Reference& reference, std::span<const float> rgb);

// True if the error `figure` cannot be distinguished from 0: it is at most three times its standard error,
// the usual limit of detection. False if the standard error is unknown.
bool below_noise(double figure, const std::optional<double>& standard_error);

}  // namespace ls
