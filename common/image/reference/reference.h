// The error of an image against a reference.
//
//   mse    = mean over pixels and channels of (x - ref)^2 - s^2
//   relmse = mean of h ((x - ref)^2 - s^2)
//
// s is the reference's own standard error, if its file has layers stderr.R, G, B (final_image.h): s = |A - B|
// / 2, where A and B are the two half means of the reference, and ref = (A + B) / 2. So A and B are ref + s
// and ref - s, in unknown order. With a and b the errors of A and B, and e that of the image,
//
//   (x - ref)^2 - s^2 = (x - A) (x - B) = (e - a) (e - b).
//
// a and b are independent with mean 0, so the expectation is e^2, whatever their distribution. With r =
// Var((a + b) / 2) the variance is 4 e^2 r + 4 r^2. Half of the second term is due to s^2, an estimate of r
// from a single difference, which is itself noisy.
//
// The weight h is the mean of f(A) and f(B), f(m) = 1 / (m^2 + 0.01). The weight f(ref) would be biased:
// where a and b are both large, f(ref) is small and (e - a) (e - b) is large. This bias amounts to f" r^2,
// many times e^2 f in a noisy reference. In (e - a) (e - b) f(A), b is not in the weight and vanishes in the
// mean, which leaves (e^2 - e a) f(A). The part with -e a averages out over an image whose errors have both
// signs. The part e^2 f(A) has the bias e^2 f" r. relative_weight() subtracts it from f, with r estimated
// from the s^2 of the neighbours, which are independent of a. The remaining bias is of second order in r: for
// bright m it is 60 r^2 / m^4 of the value.
//
// The standard errors of mse and relmse include the noise of the reference only. Over channels (e - a) . (e -
// b) has the variance 4 e'Ve + 4 tr V^2, with V the covariance of the reference. Let d = x - ref, and t = (A
// - B) / 2, so that s = |t|. For Gaussian noise 4 (d . t)^2 has this mean, because ref and A - B are
// independent. The signs of t are not stored, so d . t is replaced by the sum over channels of |d| s, which
// is at least as large. The result is exact for grey noise. For independent channels, with r much larger than
// e^2, the standard error is a third too large: the mean square of the sum is then 3 + 6 (2 / pi)^2 instead
// of 3.
//
// Without the layers stderr.R, G, B, s is 0, and the errors include an unknown amount of the reference's
// noise. With them, noise can make a difference negative; it is then set to 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/exr/exr_file.h"
#include "common/image/frame/frame.h"

namespace ls {

// The header strings lightshaft:scene and lightshaft:seed of the reference; empty if missing.
struct ReferenceOrigin {
  std::string scene, seed;
};
// True if the reference was rendered from this scene with this seed. Image and reference then share samples
// and so a part of their noise, which cancels in the difference: the result is not the image's true error.
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

// Means of s^2 and of h s^2; zeros if s is unknown.
struct ReferenceNoise {
  double mse = 0, relmse = 0;
};
ReferenceNoise noise_of(const Reference& reference);

struct TrueError {
  double rmse = 0, relmse = 0;
  // Standard errors of rmse^2 and relmse; nullopt: s is unknown
  std::optional<double> mse_stderr = {}, relmse_stderr = {};
};
// Returns the errors of the image `rgb` (R, G, B of each pixel, of the reference's size) against the
// reference.
TrueError true_error(const Reference& reference, std::span<const float> rgb);

// True if an error cannot be distinguished from 0: it is less than three times its standard error, the usual
// limit of detection. False if the standard error is unknown.
bool below_noise(double figure, const std::optional<double>& standard_error);

}  // namespace ls
