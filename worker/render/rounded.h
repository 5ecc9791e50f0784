// How a sum of samples becomes what a partial carries.
#pragma once

#include <cmath>

namespace ls::render {

// One rounding to float32; denormals become 0 here, where the mode of the process that folds can't matter any
// more.
inline float rounded(double sum) {
  const auto f = static_cast<float>(sum);
  return std::abs(f) < 0x1p-126f ? 0.f : f;
}

}  // namespace ls::render
