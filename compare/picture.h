// Images of a race until they are judged, and their errors.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame/frame.h"

namespace ls::race {

using Pixels = std::vector<float>;  // R, G, B interleaved, row by row from the top; all finite

// A folder for the images of one race, removed with the object. They are many and only read once, at the end.
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

// invalid_argument names the file: not a readable EXR, of another size, or with values that are NaN or
// infinite.
Result<Pixels> read_picture(const std::filesystem::path& exr, FrameSize size);

// The reference for a race: two independent images of the right answer, each with its own noise, or a single
// one that is taken as exact (`second` is empty).
struct Reference {
  Pixels first, second;
};

struct Wrong {
  double mse = 0, relmse = 0;
};
// Mean over pixels and channels of (x - a)(x - b), and of the same over r^2 + 0.01 with r = (a + b) / 2. With
// a and b independent of x and of each other, both unbiased, E[(x - a)(x - b)] = E[(x - truth)^2]: the
// references' own noise cancels. The result may be negative where that noise is larger than x's error. With
// one reference b = a, and its noise counts as the image's.
Wrong wrong(std::span<const float> pixels, const Reference& reference);

// relMSE of the mean of the two references, from their difference: (a - b)^2 / 4 over r^2 + 0.01. 0 for a
// single one.
double noise_of(const Reference& reference);

}  // namespace ls::race
