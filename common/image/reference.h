// The true error of an image against a reference.
//
//   rmse^2 = mean over pixels and channels of (x - ref)^2 - s^2
//   relmse = mean of ((x - ref)^2 - s^2) / (ref^2 + 0.01)
//
// s is the reference's own standard error, where its file has layers stderr.R, G, B (final_image.h): image and
// reference are independent, so E (x - ref)^2 is the image's squared error and s^2, and s^2 is known without
// bias. Without these layers s is 0 and the figures hold the reference's noise, too. The difference of noisy
// numbers can fall below zero: then nothing is left to see, and 0 stands.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/image/exr_file.h"
#include "common/image/frame.h"

namespace ls {

struct Reference {
  FrameSize size;
  std::vector<float> rgb;    // interleaved, row by row
  std::vector<float> error;  // standard error of each value; empty: not known
};
// invalid_argument: no such picture, another size than `size`, or values that are not finite. `name` is for the
// messages. Layers of errors that are not finite and positive are refused, too, rather than half used.
Result<Reference> read_reference(std::span<const std::byte> exr, const std::string& name, FrameSize size,
                                 const ExrLimits& limits = {});

// Mean of s^2, and of s^2 / (ref^2 + 0.01); zeros if it is not known.
struct ReferenceNoise {
  double mse = 0, relmse = 0;
};
ReferenceNoise noise_of(const Reference& reference);

struct TrueError {
  double rmse = 0, relmse = 0;
};
// `rgb`: the image, interleaved, of the reference's size.
TrueError true_error(const Reference& reference, std::span<const float> rgb);

}  // namespace ls
