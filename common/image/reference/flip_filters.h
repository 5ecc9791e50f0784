// The spatial filters of FLIP (flip.h), each a sum of separable filters. Used by flip.cpp only.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/image/frame/frame.h"

namespace ls::flip {

class Planes {  // three planes: Y, Cx, Cz
 public:
  explicit Planes(FrameSize size) : size_(size) {
    for (auto& plane : planes_) plane.resize(pixels());
  }
  FrameSize size() const { return size_; }
  std::size_t pixels() const {
    return static_cast<std::size_t>(size_.width) * static_cast<std::size_t>(size_.height);
  }
  std::vector<float>& operator[](std::size_t i) { return planes_[i]; }
  const std::vector<float>& operator[](std::size_t i) const { return planes_[i]; }

 private:
  FrameSize size_;
  std::array<std::vector<float>, 3> planes_;
};

// Returns the image with every plane filtered by the contrast sensitivity function ([LDR] equations (3), (4),
// table 1).
Planes contrast_filtered(const Planes& image, float pixels_per_degree);

// Returns max(|edge_r - edge_t|, |point_r - point_t|) of each pixel, from the first plane of the reference
// (r) and of the image (t) ([LDR] equations (10) to (12)).
std::vector<float> feature_difference(const Planes& reference, const Planes& image, float pixels_per_degree);

}  // namespace ls::flip
