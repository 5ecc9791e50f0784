// Stores the images of a race (integrators that render one scene at equal cost), reads reference
// images, and computes the errors of images.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/frame/frame.h"
#include "core/image/reference/reference.h"

namespace ls::race {

using Pixels = std::vector<float>;  // an image: R, G, B interleaved, row by row from the top; all finite

Result<void> keep(const std::filesystem::path& file, std::span<const float> pixels);
Result<Pixels> kept(const std::filesystem::path& file, FrameSize size);

// Reads an image of a given size. invalid_argument: it is not a readable EXR, has another size, or has values
// that are NaN or infinite; the message names the file.
Result<Pixels> read_picture(const std::filesystem::path& exr, FrameSize size);

// The reference of a race, which stands for the true image: either two independent images, each with its own
// noise, or a single image that is taken as exact (then `second` is empty).
struct Reference {
  Pixels first, second;
};

// A reference image given by the user.
struct ReferenceFile {
  std::string name;  // file name, without folders
  ls::Reference picture;
};
// Reads an image with the checks of read_picture(). The result also has the layers of standard errors and the
// seed, if the file has them.
Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size);

// Makes the reference of a race from one file, or from two files whose images are independent. A single file
// without a layer of standard errors is taken as exact. With such a layer s, its image ref counts as two
// images, ref + s and ref - s: these are the means of the two halves of its samples, in unknown order
// (core/image/reference/reference.h).
Reference combine(const std::vector<ReferenceFile>& files);
std::string describe(const std::vector<ReferenceFile>& files);

struct Wrong {
  double mse = 0, relmse = 0;
};
// Returns the errors of an image x against the two images a and b of the reference. `mse` is the mean of (x -
// a)(x - b) over pixels and channels. `relmse` is the mean of (x - a)(x - b) / (r^2 + 0.01), with r the mean
// of a and b. If a and b are unbiased and independent of x and of each other, the expectation of (x - a)(x -
// b) is (x - truth)^2: the noise of a and b cancels. A result may be negative if that noise is larger than
// the error of x. If the reference is a single image, b = a, and its noise counts as error of x.
Wrong wrong(std::span<const float> pixels, const Reference& reference);

// Returns the relMSE of r, the mean of the two images a and b of the reference. It is estimated from their
// difference, as the mean of ((a - b) / 2)^2 / (r^2 + 0.01) over pixels and channels. It is 0 if the
// reference is a single image.
double noise_of(const Reference& reference);

}  // namespace ls::race
