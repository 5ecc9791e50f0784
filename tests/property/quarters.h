// The means of the quarters of an image of 16 x 16, in each channel, for comparing two ways to render it:
// sharing moves light between pixels, and in a white room keeps the mean of all of them whatever the weights.
// Pixels that share tell too little of the error of a mean; images of different seeds are independent.
#pragma once

#include <array>
#include <cstdint>

#include "tests/support/render_check.h"

namespace ls::test {

inline constexpr int kSide = 16;
inline constexpr std::size_t kQuarters = 4 * 3;
struct Quarters {
  std::array<double, kQuarters> mean{}, variance{};  // of the mean
};
inline Quarters quarters_of(const SceneBuilder& builder, std::uint64_t spp, int seeds, std::uint64_t first) {
  Quarters all;
  std::array<double, kQuarters> squares{};
  for (int i = 0; i < seeds; ++i) {
    const auto world = world_of(builder, first + static_cast<std::uint64_t>(i), 2);
    const auto sums = render::render_tile(*world, {0, 0, kSide, kSide}, {0, spp}, nullptr, nullptr).sums;
    std::array<double, kQuarters> image{};
    for (std::size_t plane = 0; plane < 6; ++plane)
      for (std::size_t p = 0; p < kSide * kSide; ++p) {
        const std::size_t right = p % kSide >= kSide / 2, below = p / kSide >= kSide / 2;
        image[(2 * below + right) * 3 + plane % 3] +=
            double{sums[plane * kSide * kSide + p]} / (static_cast<double>(spp) * kSide * kSide / 4);
      }
    for (std::size_t q = 0; q < kQuarters; ++q) {
      all.mean[q] += image[q] / seeds;
      squares[q] += image[q] * image[q] / seeds;
    }
  }
  for (std::size_t q = 0; q < kQuarters; ++q)
    all.variance[q] = (squares[q] - all.mean[q] * all.mean[q]) / (seeds - 1);
  return all;
}

}  // namespace ls::test
