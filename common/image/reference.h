// The true error of an image against a reference.
//
//   mse    = mean over pixels and channels of (x - ref)^2 - s^2
//   relmse = mean of h ((x - ref)^2 - s^2)
//
// s is the reference's own standard error, where its file has layers stderr.R, G, B (final_image.h): s = |A -
// B| / 2, with A and B the two half means of the reference, ref = (A + B) / 2. So A and B are ref + s and ref
// - s, though in which order is not known, and with a and b their errors and e that of the image
//
//   (x - ref)^2 - s^2 = (x - A) (x - B) = (e - a) (e - b).
//
// a and b are independent with mean 0: its expectation is e^2, whatever their distribution, and with r =
// Var((a + b) / 2) its variance is 4 e^2 r + 4 r^2 (half of the second term is that s^2 itself is known from
// one difference only).
//
// The weight h is the mean of f(A) and f(B), f(m) = 1 / (m^2 + 0.01). f(ref) would be biased: it falls where
// a and b are both large, which is where (e - a) (e - b) is, and that adds up to f" r^2, many times e^2 f in
// a noisy reference. In (e - a) (e - b) f(A) b stands alone and is 0 in the mean, which leaves (e^2 - e a)
// f(A): -e a averages out over an image whose errors have both signs, and of e^2 f(A) the bias e^2 f" r is
// subtracted within f (relative_weight()), with r from the neighbours' s^2, which do not know of a. What
// remains is of second order: for bright m 60 r^2 / m^4 of the value.
//
// The standard error of these figures, which is the reference's noise alone: over channels
// (e - a) . (e - b) has the variance 4 e'Ve + 4 tr V^2 with V the covariance of the reference, and for
// Gaussian noise 4
// ((x - ref) . s)^2 with the signs of s has that mean, for ref and A - B are independent. The signs are not
// stored; the sum of |x - ref| s is not less. So with grey noise it is right, and where channels are
// independent a third too wide (with r much larger than e^2; there the mean of the square is 3 + 6 (2 / pi)^2
// of 3).
//
// Without these layers s is 0, the figures hold the reference's noise, too, and how much is not known. The
// difference of noisy numbers can fall below zero: then 0 stands.
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
#include "common/image/exr_file.h"
#include "common/image/frame.h"

namespace ls {

// What its header says of who made it, lightshaft:scene and lightshaft:seed; empty: nothing.
struct ReferenceOrigin {
  std::string scene, seed;
};
// Whether it was rendered of this scene with this seed. Then image and reference share their samples: the
// noise that they share is in no difference between them, and no figure says how wrong the image is.
bool same_noise(const ReferenceOrigin& origin, const Digest& scene, std::uint64_t seed);
inline constexpr const char* kSameSeed =
    "the reference shares this job's seed: its noise is the same noise; render it with another --seed";

struct Reference {
  FrameSize size;
  std::vector<float> rgb;    // interleaved, row by row
  std::vector<float> error;  // standard error of each value; empty: not known
  ReferenceOrigin origin = {};
};
// invalid_argument: no such picture, another size than `size`, or values that are not finite. `name` is for
// the messages. Layers of errors that are not finite and positive are refused, too, rather than half used.
Result<Reference> read_reference(std::span<const std::byte> exr, const std::string& name, FrameSize size,
                                 const ExrLimits& limits = {});

// Mean of s^2, and of h s^2; zeros if it is not known.
struct ReferenceNoise {
  double mse = 0, relmse = 0;
};
ReferenceNoise noise_of(const Reference& reference);

struct TrueError {
  double rmse = 0, relmse = 0;
  std::optional<double> mse_stderr = {}, relmse_stderr = {};  // of rmse^2 and relmse; nothing: s is not known
};
// `rgb`: the image, interleaved, of the reference's size.
TrueError true_error(const Reference& reference, std::span<const float> rgb);

// Whether a figure is not to be told from 0: less than three standard errors above it, as limits of detection
// are drawn. Never where the standard error is not known.
bool below_noise(double figure, const std::optional<double>& standard_error);

}  // namespace ls
