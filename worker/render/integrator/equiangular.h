// Equi-angular distance sampling along a segment about a pivot (Kulla and Fajardo 2012): the density is
// proportional to 1 / distance^2, where distance is the distance to the pivot. Positions are offsets x in [a,
// b] along the segment, measured from the foot of the perpendicular from the pivot. The textbook difference
// of arctangents cancels when both ends are far from the foot on one side; the forms used here do not (pdf
// accurate to 4e-7 in float32).
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/base/work_counters.h"
#include "worker/render/math/math.h"

namespace ls::render {

// The largest ratio of densities. Ratios are clamped to it, so that no product with one is 0 times infinity.
inline constexpr float kMaxRatio = 1e30f;

class EquiAngular {
 public:
  // Prepares the segment o + t d, t in [0, length]. d must be of unit length, and length finite and positive.
  EquiAngular(const V3& o, const V3& d, float length, const V3& pivot) : d_(d) {
    LS_COUNT(equiangular);
    const float along = dot(pivot - o, d);
    foot_ = o + d * along;
    a_ = -along;
    b_ = length - along;
    const V3 off = pivot - foot_;
    distance_ = std::max(std::sqrt(dot(off, off)), 1e-7f * std::max(std::abs(a_), std::abs(b_)));
    angle_ = std::atan2(distance_ * (b_ - a_), distance_ * distance_ + a_ * b_);
    uniform_ = !(b_ - a_ > 1e-6f * distance_) || !(angle_ > 0);
  }

  struct Sample {
    float t;    // from the segment's start
    V3 p;       // computed from the foot of the perpendicular: accurate near the light
    float pdf;  // density per unit length
  };
  Sample sample(float xi) const {
    float x;
    if (uniform_) {
      x = a_ + xi * (b_ - a_);
    } else if (a_ < 0 && b_ > 0) {
      x = std::clamp(distance_ * std::tan(std::atan2(a_, distance_) + xi * angle_), a_, b_);
    } else {
      const float q = std::tan(xi * angle_) / distance_;
      const float s = (distance_ * distance_ + a_ * a_) * q / (1 - a_ * q);
      x = a_ + std::clamp(s, 0.f, b_ - a_);
    }
    return {x - a_, foot_ + d_ * x, density(x)};
  }
  float pdf(float t) const { return density(t + a_); }

 private:
  float density(float x) const {
    return uniform_ ? 1 / (b_ - a_) : distance_ / (angle_ * (distance_ * distance_ + x * x));
  }

  V3 d_, foot_;
  float a_ = 0, b_ = 0, distance_ = 0, angle_ = 0;
  bool uniform_ = false;
};

}  // namespace ls::render
