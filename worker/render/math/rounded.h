// Converts a sum of samples to the float32 stored in a partial image.
#pragma once

#include <cmath>

namespace ls::render {

// Rounds once to float32. Denormals are flushed to 0 here, so that the denormal mode of the process that
// folds partials cannot matter.
inline float rounded(double sum) {
  const auto f = static_cast<float>(sum);
  return std::abs(f) < 0x1p-126f ? 0.f : f;
}

}  // namespace ls::render
