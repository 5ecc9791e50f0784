// Applies reconstruction filters by importance sampling. Each sample belongs to one pixel, and its position
// is drawn from the filter around that pixel; so no sample contributes to the pixels of another tile (Ernst,
// Stamminger, Greiner 2006). The scene reader rejects filters with negative lobes.
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

class PixelFilter {
 public:
  PixelFilter() = default;
  explicit PixelFilter(const ReconstructionFilter& filter);
  // Returns the offset of a sample from the pixel's centre along one axis, in pixels, for the random number u
  // in [0, 1).
  double offset(float u) const;

 private:
  enum class Kind { box, tent, table } kind_ = Kind::box;
  double radius_ = .5;
  std::vector<double> cdf_;  // table: cdf of the filter on [-radius, radius] in cdf_.size() - 1 equal steps
};

}  // namespace ls::render
