// Bounds of the values that a function has in a region.
#pragma once

namespace ls::render {

struct ValueBounds {
  float lo = 0, hi = 0;
};

}  // namespace ls::render
