// Stores the images of a race until they are judged, reads reference images, and computes errors.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame/frame.h"
#include "common/image/reference/reference.h"

namespace ls::race {

using Pixels = std::vector<float>;  // R, G, B interleaved, row by row from the top; all finite

// A folder for the images of one race, which is removed with the object. The images are on disk because they
// are many, and are read only once, at the end.
class Scratch {
 public:
  static Result<Scratch> make();
  ~Scratch();
  Scratch(Scratch&& other) noexcept : folder_(std::exchange(other.folder_, {})) {}
  Scratch& operator=(Scratch&&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

 private:
  explicit Scratch(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
};

Result<void> keep(const std::filesystem::path& file, std::span<const float> pixels);
Result<Pixels> kept(const std::filesystem::path& file, FrameSize size);

// Reads an image of a given size. invalid_argument: it is not a readable EXR, has another size, or has values
// that are NaN or infinite; the message names the file.
Result<Pixels> read_picture(const std::filesystem::path& exr, FrameSize size);

// The reference for a race: either two independent images of the right answer, each with its own noise, or a
// single image that is taken as exact (then `second` is empty).
struct Reference {
  Pixels first, second;
};

// A reference image given by the user.
struct ReferenceFile {
  std::string name;  // without folders
  ls::Reference picture;
};
// Reads an image like read_picture(), with the error layers and the seed that the file has.
Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size);

// Makes the reference of a race from one file, or from two that are independent of each other. A single file
// with a layer of standard errors s counts as two images: ref + s and ref - s are the means of the two halves
// of its samples, though it is unknown which is which (common/image/reference/reference.h).
Reference combine(const std::vector<ReferenceFile>& files);
std::string describe(const std::vector<ReferenceFile>& files);

struct Wrong {
  double mse = 0, relmse = 0;
};
// Returns the errors of an image x against the reference images a and b. `mse` is the mean over pixels and
// channels of (x - a)(x - b); `relmse` is the mean of the same divided by r^2 + 0.01, where r = (a + b) / 2.
// If a and b are unbiased and independent of x and of each other, E[(x - a)(x - b)] = E[(x - truth)^2]: the
// references' own noise cancels. The result may be negative where that noise is larger than the error of x.
// With a single reference b = a, and its noise counts as error of the image.
Wrong wrong(std::span<const float> pixels, const Reference& reference);

// Returns the relMSE of the mean of the two references a and b, estimated from their difference: the mean of
// ((a - b) / 2)^2 / (r^2 + 0.01), where r = (a + b) / 2. It is 0 for a single reference.
double noise_of(const Reference& reference);

}  // namespace ls::race
