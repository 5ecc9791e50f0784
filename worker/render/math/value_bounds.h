// Bounds of the values that a function has in a region, and their sum.
#pragma once

#include <limits>

namespace ls::render {

struct ValueBounds {
  float lo = 0, hi = 0;
};

// The least and the largest of some values that are not negative, and their sum.
struct ValueSums {
  float lo = std::numeric_limits<float>::infinity(), hi = 0;
  double sum = 0;
};

}  // namespace ls::render
