// Fog whose density falls exponentially with height, and is constant below the ground: e^(-max(0, a(p))),
// where the level a(p) of a point, its height above the ground in scale heights, is an affine function of p.
// Along a ray the density is constant below the ground and exponential in the distance above it, so its
// integral and the inverse of its integral have closed forms. They are computed in double, in forms that
// neither cancel nor overflow for rays almost level, without end, or from any height.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/render/math/math.h"

namespace ls::render {

struct HeightProfile {
  V3d rise{0, 0, 0};  // the gradient of the level [1/world unit]
  double base = 0;    // the level at the origin

  double level(const V3d& p) const { return base + rise.dot(p); }
  // Returns the density at p, in (0, 1].
  double density(const V3d& p) const { return std::exp(-std::max(0., level(p))); }
};

// The density along a ray o + t d, t >= 0.
class HeightRay {
 public:
  HeightRay(const HeightProfile& fog, const V3& o, const V3& d)
      : level_(fog.level(V3d(o))), climb_(fog.rise.dot(V3d(d))) {}

  double density(double t) const {
    // Without this test a level ray of infinite length would give 0 times infinity.
    return std::exp(-std::max(0., climb_ == 0 ? level_ : level_ + climb_ * t));
  }
  // Returns the density integrated from 0 to t, which may be infinite. The result is infinite if the integral
  // diverges.
  double depth(double t) const {
    if (climb_ > 0) {
      const double ground = std::max(0., -level_ / climb_);  // the distance below the ground
      if (t <= ground) return t;
      return ground + times(std::exp(-std::max(0., level_)), faded(climb_, t - ground));
    }
    const double above = level_ <= 0 ? 0 : climb_ == 0 ? t : std::min(t, -level_ / climb_);
    // Above the ground the density is seen from the lower end, where it is largest, so that it never
    // overflows.
    const double lower = climb_ == 0 ? level_ : level_ + climb_ * above;
    const double there = above > 0 ? times(std::exp(-std::max(0., lower)), faded(-climb_, above)) : 0;
    return there + (t > above ? t - above : 0);
  }
  // Returns the distance up to which the density integrates to x; infinite if it never does.
  double distance(double x) const {
    if (!(x > 0)) return 0;
    if (climb_ > 0) {
      const double ground = std::max(0., -level_ / climb_);
      if (x <= ground) return x;
      // With y the rest of x, over the density at the start: 1 - e^(-climb t) = climb y
      const double y = (x - ground) * std::exp(std::max(0., level_)), share = climb_ * y;
      if (!(share < 1)) return kNever;
      return ground + (share < kTiny ? y : -std::log1p(-share) / climb_);
    }
    if (level_ <= 0) return x;
    if (climb_ == 0) return x * std::exp(level_);
    const double ground = -level_ / climb_, above = depth(ground);
    if (x >= above) return ground + (x - above);
    // e^(-climb t) - 1 = -climb x e^level. The logarithms are taken before the exponential can overflow or
    // the product underflow.
    const double y = x * std::exp(level_), growth = -climb_ * y;
    if (growth < kTiny) return y;
    if (growth < kHuge) return std::log1p(growth) / -climb_;
    return (level_ + std::log(-climb_) + std::log(x)) / -climb_;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  // Below kTiny 1 - e^-x is x to double precision, and above kHuge 1 + x is x.
  static constexpr double kTiny = 1e-20, kHuge = 1e300;
  // Returns the integral of e^(-rate t) from 0 to t, for rate >= 0.
  static double faded(double rate, double t) {
    return rate * t < kTiny || rate == 0 ? t : -std::expm1(-rate * t) / rate;
  }
  // Returns a product that is 0 if the density is, even over an infinite length.
  static double times(double density, double length) { return density > 0 ? density * length : 0; }

  double level_, climb_;  // at the ray's origin, and per unit of distance
};

}  // namespace ls::render
