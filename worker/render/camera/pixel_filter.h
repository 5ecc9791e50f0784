// Reconstruction filters by importance sampling: each sample belongs to one pixel, its position drawn from
// the filter, so that tiles are disjoint (Ernst, Stamminger, Greiner 2006). The scene reader rejects filters
// with negative lobes.
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

class PixelFilter {
 public:
  PixelFilter() = default;
  explicit PixelFilter(const ReconstructionFilter& filter);
  // Offset from the pixel's centre, in pixels, for u in [0, 1).
  double offset(float u) const;

 private:
  enum class Kind { box, tent, table } kind_ = Kind::box;
  double radius_ = .5;
  std::vector<double> cdf_;  // table: cdf of the filter on [-radius, radius] in cdf_.size() - 1 equal steps
};

}  // namespace ls::render
