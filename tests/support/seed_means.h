// The mean of images whose pixels depend on each other, with its error.
#pragma once

#include <array>
#include <cstdint>

#include "tests/support/render_check.h"

namespace ls::test {

struct Means {
  std::array<double, 3> mean{}, variance{};  // of the mean
};
// Pixels that share light vertices or paths tell too little of the error of their image's mean. Images of
// different seeds are independent.
inline Means means_of(const SceneBuilder& builder, std::uint64_t spp, int seeds, std::uint64_t first) {
  Means all;
  std::array<double, 3> squares{};
  for (int i = 0; i < seeds; ++i) {
    const Estimate e = estimate(builder, spp, first + static_cast<std::uint64_t>(i));
    for (std::size_t c = 0; c < 3; ++c) {
      all.mean[c] += e.mean[c] / seeds;
      squares[c] += e.mean[c] * e.mean[c] / seeds;
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    all.variance[c] = (squares[c] - all.mean[c] * all.mean[c]) / (seeds - 1);
  return all;
}

}  // namespace ls::test
