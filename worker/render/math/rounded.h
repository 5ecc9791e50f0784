// Converts a sum of samples to the float32 that is stored in a partial: the pixel sums of one unit, that is,
// of one tile and range of samples.
#pragma once

#include <cmath>

namespace ls::render {

// Rounds `sum` once to float32. Denormals become 0, so that the result does not depend on whether the process
// that adds up the partials treats denormals as 0.
inline float rounded(double sum) {
  const auto f = static_cast<float>(sum);
  return std::abs(f) < 0x1p-126f ? 0.f : f;
}

}  // namespace ls::render
