// Optical depth along a ray, expressed by a parameter x in which every medium looks homogeneous: x is the
// density integrated along the ray from its origin to a point, and light of channel c that gets there is
// attenuated to about the share exp(-sigma_t[c] x). In a homogeneous medium the density is 1, so x is the
// distance, and the attenuation is exact. So it is in fog that falls with height (height_fog.h). In a grid
// the density is taken to be constant in each macro cell (a block of voxels, grid.h): about the mean of its
// values. Nothing is stored: each query traverses the cells again (a few nanoseconds per cell).
#pragma once

#include <cmath>
#include <span>
#include <type_traits>

#include "worker/render/base/features.h"
#include "worker/render/media/medium.h"

namespace ls::render {

// A point on a ray.
struct DepthPoint {
  float t = 0;     // distance from the ray's origin [world units]
  float x = 0;     // density integrated from the ray's origin to t
  float rate = 0;  // dx / dt at t; 0 outside of the medium
  V3 index{0, 0, 0};
};

// kHeight is false if the medium is known not to fall with height.
template <bool kHeight>
class OpticalDepthOf {
 public:
  using Point = DepthPoint;

  // Prepares the ray o + t d from t = 0 to t_max, which may be infinite. d has unit length.
  OpticalDepthOf(const Medium& m, const V3& o, const V3& d, float t_max)
      : medium_(&m), o_(o), d_(d), t_max_(t_max), to_(t_max), total_(t_max) {
    if (m.grid)
      measure();
    else if (falls())
      total_ = static_cast<float>(height().depth(t_max));
  }

  // The part [from(), to()] of the ray contains all of the medium that the ray meets. to() is infinite if
  // neither the ray nor the medium ends.
  float from() const { return from_; }
  float to() const { return to_; }
  // The value of x at to(). It is 0 if the ray misses the medium.
  float total() const { return total_; }

  Point at(float t) const {
    if (medium_->grid) return grid_at(t);
    return falls() ? height_at(t, height().depth(t)) : Point{t, t, 1, {0, 0, 0}};
  }
  Point after(float x) const {
    if (medium_->grid) return grid_after(x);
    return falls() ? height_at(height().distance(x), x) : Point{x, x, 1, {0, 0, 0}};
  }

  // Sets x[i] to the density integrated up to t[i], for ascending t, by one traversal.
  void at_each(std::span<const float> t, std::span<double> x) const;

  // Returns the scattering coefficients [1/world unit] at `at_point`, whose position in the world is p.
  C3 scattering(const Point& at_point, const V3& p) const {
    if (medium_->grid) return grid_scattering(at_point, p);
    return falls() ? medium_->sigma_s * at_point.rate : medium_->sigma_s;
  }

 private:
  bool falls() const {
    if constexpr (kHeight) return medium_->height.has_value();
    return false;
  }
  HeightRay height() const { return {*medium_->height, o_, d_}; }
  // Rounding may have moved x beyond the whole of it, and t to infinity: there is no medium.
  Point height_at(double t, double x) const {
    const auto at = static_cast<float>(t);
    if (!std::isfinite(at)) return {0, static_cast<float>(x), 0, {0, 0, 0}};
    return {at, static_cast<float>(x), static_cast<float>(height().density(t)), {0, 0, 0}};
  }
  void measure();
  C3 grid_scattering(const Point& at_point, const V3& p) const;
  Point grid_at(float t) const;
  Point grid_after(float x) const;

  const Medium* medium_;
  V3 o_, d_;
  float t_max_, from_ = 0, to_, total_;
};

extern template class OpticalDepthOf<false>;
extern template class OpticalDepthOf<true>;
using OpticalDepth = OpticalDepthOf<true>;  // of any medium

// OpticalDepth for a medium that is known to be homogeneous: the same interface, but no cells to traverse.
class HomogeneousOpticalDepth {
 public:
  HomogeneousOpticalDepth(const Medium& m, const V3&, const V3&, float t_max)
      : sigma_s_(m.sigma_s), t_max_(t_max) {}
  static float from() { return 0; }
  float to() const { return t_max_; }
  float total() const { return t_max_; }
  static DepthPoint at(float t) { return {t, t, 1, {0, 0, 0}}; }
  static DepthPoint after(float x) { return {x, x, 1, {0, 0, 0}}; }
  C3 scattering(const DepthPoint&, const V3&) const { return sigma_s_; }

 private:
  C3 sigma_s_;
  float t_max_;
};
template <Features F>
using OpticalDepthIn =
    std::conditional_t<F.grids || F.height, OpticalDepthOf<F.height>, HomogeneousOpticalDepth>;

}  // namespace ls::render
