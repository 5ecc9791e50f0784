// The means of the quarters of an image of 16 x 16, in each channel, for comparing two ways to render it:
// sharing moves light between pixels, and in a white room keeps the mean of all of them whatever the weights.
// Pixels that share tell too little of the error of a mean; images of different seeds are independent.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "tests/support/render_check.h"
#include "tests/support/significance.h"

namespace ls::test {

inline constexpr int kSide = 16;
inline constexpr std::size_t kQuarters = 4 * 3;
struct Quarters {
  std::array<double, kQuarters> mean{}, variance{};  // of the mean
};
using QuarterImage = std::array<double, kQuarters>;
inline QuarterImage quarter_image(const SceneBuilder& builder, std::uint64_t spp, std::uint64_t seed) {
  const auto world = world_of(builder, seed, 2);
  const auto sums = render::render_tile(*world, {0, 0, kSide, kSide}, {0, spp}, nullptr, nullptr).sums;
  QuarterImage image{};
  for (std::size_t plane = 0; plane < 6; ++plane)
    for (std::size_t p = 0; p < kSide * kSide; ++p) {
      const std::size_t right = p % kSide >= kSide / 2, below = p / kSide >= kSide / 2;
      image[(2 * below + right) * 3 + plane % 3] +=
          double{sums[plane * kSide * kSide + p]} / (static_cast<double>(spp) * kSide * kSide / 4);
    }
  return image;
}
// image(i): number i of `seeds` independent images
template <class Image>
Quarters quarters_of(int seeds, Image&& image_of) {
  Quarters all;
  QuarterImage squares{};
  for (int i = 0; i < seeds; ++i) {
    const QuarterImage image = image_of(i);
    for (std::size_t q = 0; q < kQuarters; ++q) {
      all.mean[q] += image[q] / seeds;
      squares[q] += image[q] * image[q] / seeds;
    }
  }
  for (std::size_t q = 0; q < kQuarters; ++q)
    all.variance[q] = (squares[q] - all.mean[q] * all.mean[q]) / (seeds - 1);
  return all;
}
inline Quarters quarters_of(const SceneBuilder& builder, std::uint64_t spp, int seeds, std::uint64_t first) {
  return quarters_of(
      seeds, [&](int i) { return quarter_image(builder, spp, first + static_cast<std::uint64_t>(i)); });
}

// Fails if the means of two ways to render the same image, each over `seeds` images, differ at this level.
// Returns the largest tolerance of any mean, as a part of it.
inline double expect_same_quarters(const char* name, double level, const Quarters& a, const Quarters& b,
                                   int seeds) {
  double least = 1, largest = 0;
  for (std::size_t q = 0; q < kQuarters; ++q) {
    const double error = std::sqrt(a.variance[q] + b.variance[q]);
    // Student's test with the freedom of one of the two alone: that of both together is larger
    const double tolerance = cli::student_quantile(level, seeds - 1) * error;
    EXPECT_LT(std::abs(a.mean[q] - b.mean[q]), tolerance)
        << name << ", quarter and channel " << q << ": " << a.mean[q] << " and " << b.mean[q];
    least = std::min(least, error / b.mean[q]);
    largest = std::max(largest, tolerance / b.mean[q]);
  }
  std::printf("%s: +- %.2g %%\n", name, 100 * least);
  EXPECT_LT(least, .015) << name << ": the test has no power";
  return largest;
}

}  // namespace ls::test
