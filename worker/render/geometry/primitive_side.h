// Splits a range of primitives into its two sides: side 0 contains the opaque ones, side 1 those that let
// light pass.
#pragma once

#include "worker/render/geometry/geometry.h"

namespace ls::render {

struct Side {
  std::uint32_t first, last;
  std::uint32_t count() const { return last - first; }
};
inline Side side_of(const PrimitiveRange& r, int side) {
  return side ? Side{r.passing, r.last} : Side{r.first, r.passing};
}

}  // namespace ls::render
