// Reconstruction filters by importance sampling: each sample lands in one pixel, its position drawn from the
// filter, so that tiles are disjoint (Ernst, Stamminger, Greiner 2006). Negative lobes are refused by the
// reader.
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math.h"

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
  std::vector<double> cdf_;  // table: of the filter on [-radius, radius], cdf_.size() - 1 equal steps
};

}  // namespace ls::render
