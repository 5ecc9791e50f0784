// Optical depth along a ray, parametrised so that the medium looks homogeneous. The parameter x is the
// density integrated along the ray up to a point, and light of channel c is attenuated by about
// exp(-sigma_t[c] x). In a homogeneous medium x is the length and the attenuation is exact. In a grid x
// integrates the macro cells' mean densities. Nothing is stored: each query traverses the cells again (a few
// nanoseconds per cell).
#pragma once

#include <type_traits>

#include "worker/render/base/features.h"
#include "worker/render/media/medium.h"

namespace ls::render {

class OpticalDepth {
 public:
  struct Point {
    float t = 0;     // distance along the ray
    float x = 0;     // density integrated from the origin to t
    float rate = 0;  // dx / dt; 0 where the medium is absent
    V3 index{0, 0, 0};
  };

  // Prepares the ray o + t d from t = 0 to t_max, which may be infinite. d has unit length.
  OpticalDepth(const Medium& m, const V3& o, const V3& d, float t_max)
      : medium_(&m), o_(o), d_(d), t_max_(t_max), to_(t_max), total_(t_max) {
    if (m.grid) measure();
  }

  // The medium is empty outside of the part [from(), to()] of the ray. to() is infinite if the medium has no
  // end.
  float from() const { return from_; }
  float to() const { return to_; }
  // The value of x at to(). It is 0 if the ray misses the medium.
  float total() const { return total_; }

  Point at(float t) const { return medium_->grid ? grid_at(t) : Point{t, t, 1, {0, 0, 0}}; }
  Point after(float x) const { return medium_->grid ? grid_after(x) : Point{x, x, 1, {0, 0, 0}}; }

  // Scattering coefficients at a point; p is its position in the world.
  C3 scattering(const Point& at_point, const V3& p) const {
    return medium_->grid ? grid_scattering(at_point, p) : medium_->sigma_s;
  }

 private:
  void measure();
  C3 grid_scattering(const Point& at_point, const V3& p) const;
  Point grid_at(float t) const;
  Point grid_after(float x) const;

  const Medium* medium_;
  V3 o_, d_;
  float t_max_, from_ = 0, to_, total_;
};

// OpticalDepth for a medium known to be homogeneous: the same interface, without any traversal.
class HomogeneousOpticalDepth {
 public:
  HomogeneousOpticalDepth(const Medium& m, const V3&, const V3&, float t_max)
      : sigma_s_(m.sigma_s), t_max_(t_max) {}
  static float from() { return 0; }
  float to() const { return t_max_; }
  float total() const { return t_max_; }
  static OpticalDepth::Point at(float t) { return {t, t, 1, {0, 0, 0}}; }
  static OpticalDepth::Point after(float x) { return {x, x, 1, {0, 0, 0}}; }
  C3 scattering(const OpticalDepth::Point&, const V3&) const { return sigma_s_; }

 private:
  C3 sigma_s_;
  float t_max_;
};
template <Features F>
using OpticalDepthIn = std::conditional_t<F.grids, OpticalDepth, HomogeneousOpticalDepth>;

}  // namespace ls::render
