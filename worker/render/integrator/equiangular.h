// Equi-angular distance sampling along a segment about a pivot, the point that stands for the light
// (light_kind.h). The method is that of Kulla and Fajardo 2012: the density is proportional to 1 /
// distance^2, where distance is the distance to the pivot. Positions are offsets x in [a, b] along the
// segment, measured from the foot of the perpendicular from the pivot. The textbook difference of arctangents
// cancels when both ends are far from the foot on one side; the forms used here do not (pdf accurate to 4e-7
// in float32). If the light shines into a cone, only the part of the segment inside the cone is sampled.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/base/work_counters.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/lights/light_kind.h"
#include "worker/render/math/math.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/optical_depth.h"

namespace ls::render {

// Ratios of densities are clamped to this value, so that no product with a ratio is 0 times infinity.
inline constexpr float kMaxRatio = 1e30f;

class EquiAngular {
 public:
  // Prepares the segment o + t d, t in [0, length]. d must be of unit length, and length finite and positive.
  EquiAngular(const V3& o, const V3& d, float length, const Pivot& pivot) : d_(d) {
    LS_COUNT(equiangular);
    const float along = dot(pivot.p - o, d);
    foot_ = o + d * along;
    start_ = a_ = -along;
    b_ = length - along;
    const V3 off = pivot.p - foot_;
    distance_ = std::max(std::sqrt(dot(off, off)), 1e-7f * std::max(std::abs(a_), std::abs(b_)));
    if (pivot.cos_reach > 0) keep_lit(pivot, off);
    angle_ = std::atan2(distance_ * (b_ - a_), distance_ * distance_ + a_ * b_);
    uniform_ = !(b_ - a_ > 1e-6f * distance_) || !(angle_ > 0);
  }

  struct Sample {
    float t;    // distance from the segment's start
    V3 p;       // computed from the foot of the perpendicular: accurate near the light
    float pdf;  // density per unit length; 0 if no light reaches the segment
  };
  Sample sample(float xi) const {
    if (!(b_ > a_)) return {a_ - start_, foot_ + d_ * a_, 0};
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
    return {x - start_, foot_ + d_ * x, density(x)};
  }
  float pdf(float t) const {
    const float x = t + start_;
    if (!limited_) return density(x);
    return x >= a_ && x <= b_ && b_ > a_ ? density(x) : 0;
  }

 private:
  // Limits [a, b] to the part inside the light's cone. In the plane of the pivot and the segment, let `angle`
  // be the angle at the pivot from the foot to a point of the segment, `mid` the angle from the foot to the
  // projection of the cone's axis, and m the length of this projection. The direction to the point has the
  // cosine m cos(angle - mid) to the axis, and the point is inside the cone where this is at least cos_reach.
  // The interval stays whole if the line passes the pivot so closely that the direction of the foot is lost
  // in rounding.
  void keep_lit(const Pivot& pivot, const V3& off) {
    // kRightAngle is less than pi / 2, but more than atan(1 / kCloseness), which no `angle` exceeds
    constexpr float kCloseness = 1e-5f, kRightAngle = 1.57079f;
    const float size = std::max(std::abs(a_), std::abs(b_)), r = std::sqrt(dot(off, off));
    if (!(r > kCloseness * size)) return;
    limited_ = true;
    const float aside = -dot(pivot.axis, off) / r, along = dot(pivot.axis, d_);
    const float m = std::sqrt(aside * aside + along * along);
    // `margin` covers rounding, which moves the foot by at most 4 ulps of `size`
    const float margin = 1e-6f + 4.8e-7f * size / r;
    const float half = std::acos(std::min(1.f, pivot.cos_reach / m)) + margin;
    const float mid = std::atan2(along, aside), lo = mid - half, hi = mid + half;
    if (m < pivot.cos_reach - margin || lo >= kRightAngle || hi <= -kRightAngle) {
      b_ = a_;
      return;
    }
    if (lo > -kRightAngle) a_ = std::max(a_, r * std::tan(lo));
    if (hi < kRightAngle) b_ = std::min(b_, r * std::tan(hi));
  }
  float density(float x) const {
    return uniform_ ? 1 / (b_ - a_) : distance_ / (angle_ * (distance_ * distance_ + x * x));
  }

  V3 d_, foot_;
  float start_ = 0;  // offset x of the segment's start; less than a_ if the light does not reach the start
  float a_ = 0, b_ = 0, distance_ = 0, angle_ = 0;
  bool uniform_ = false, limited_ = false;
};

// Free flight through a medium with lamps (lights without extent). A share of the flights ends at a distance
// that is sampled equi-angularly about a lamp. Multiply scattered light grows as 1 / distance near a lamp,
// and plain exponential flights rarely end that near.
inline constexpr float kLampFlightShare = .1f;

// Samples a flight from o along d, through a medium that is no grid, that ends at t_max at the latest; t_max
// must be finite. `hero` is the colour channel that decides distances (medium.h). There must be at least one
// lamp. The random number u(1) of `numbers` decides how the distance is sampled: exponentially, with the
// random bits bits[0], or about a lamp, with u(2). The weight and the densities of the result mean the same
// as those of free_flight(). The density of a distance is that of the mixture, so the weights follow the
// balance heuristic.
template <Features F>
Flight fly_past_lamps(const Medium& medium, int hero, const Group& numbers, const V3& o, const V3& d,
                      float t_max, const Lamps& lamps) {
  const auto about = [&](std::size_t i) { return EquiAngular(o, d, t_max, lamps.position[i]); };
  const OpticalDepthIn<F> depths(medium, o, d, t_max);
  Flight f;
  if (const float choice = numbers.u(1); choice < kLampFlightShare) {
    const auto lamp = static_cast<std::size_t>(choice / kLampFlightShare * static_cast<float>(lamps.count));
    f.t = about(std::min(lamp, lamps.count - 1)).sample(numbers.u(2)).t;
  } else {
    const float s = medium.sigma_t[hero];
    f.t = kInfinity;
    if (s > 0) {
      const DepthPoint end = depths.after(exponential(numbers.bits[0]) / s);
      if (end.rate > 0) f.t = end.t;
    }
  }
  f.scattered = f.t < t_max;
  const float length = f.scattered ? f.t : t_max;
  float near = 0;
  if (f.scattered) {
    for (std::size_t i = 0; i < lamps.count; ++i) near += about(i).pdf(length);
    near *= kLampFlightShare / static_cast<float>(lamps.count);
  }
  // For each channel: the transmittance, and the density of this flight if the channel were the hero
  const DepthPoint at_end = depths.at(length);
  C3 through, pdf;
  for (int c = 0; c < 3; ++c) {
    through[c] = std::exp(-medium.sigma_t[c] * at_end.x);
    const float alone = (1 - kLampFlightShare) * through[c];
    pdf[c] = f.scattered ? medium.sigma_t[c] * at_end.rate * alone + near : alone;
  }
  const float own = pdf[hero];
  // If the hero's density underflows to 0, the transmittance is 0, too
  if (!(own > 0)) {
    f.weight = C3(0);
    return f;
  }
  for (int c = 0; c < 3; ++c) {
    f.weight[c] = (f.scattered ? medium.sigma_s[c] * at_end.rate * through[c] : through[c]) / own;
    f.density[c] = pdf[c] / own;
  }
  return f;
}

}  // namespace ls::render
