// Pictures of a race on their way to being judged, and how wrong one is.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame.h"

namespace ls::race {

using Pixels = std::vector<float>;  // R, G, B interleaved, row by row from the top; all finite

// A folder for the pictures of one race, which goes with it. They are many and only read once, at the end.
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

// invalid_argument names the file: it is no EXR that we can read, of another size, or has values that are NaN
// or infinite.
Result<Pixels> read_picture(const std::filesystem::path& exr, FrameSize size);

// What a picture is measured against: two independent pictures of the right answer, each with noise of its
// own, or a single one that is taken for exact (`second` is empty).
struct Reference {
  Pixels first, second;
};

struct Wrong {
  double mse = 0, relmse = 0;
};
// mean over pixels and channels of (x - a)(x - b), and of the same over r^2 + 0.01 with r = (a + b) / 2. With
// a and b independent of x and of each other, both right in expectation, E[(x - a)(x - b)] = E[(x -
// truth)^2]: the references' own noise drops out. It may come out negative where that noise is larger than
// x's error. With one reference b = a, and its noise counts as the picture's.
Wrong wrong(std::span<const float> pixels, const Reference& reference);

// relMSE of the mean of the two references, from their difference: (a - b)^2 / 4 over r^2 + 0.01. 0 with one.
double noise_of(const Reference& reference);

}  // namespace ls::race
