// Optical depth along a ray, expressed by a parameter x in which every medium looks homogeneous: x is the
// density integrated along the ray from its origin to a point, and light of channel c that gets there is
// attenuated to about the share exp(-sigma_t[c] x). In a homogeneous medium the density is 1, so x is the
// distance, and the attenuation is exact. In a grid the density is taken to be constant in each macro cell (a
// block of voxels, grid.h): about the mean of its values. Nothing is stored: each query traverses the cells
// again (a few nanoseconds per cell).
#pragma once

#include <span>
#include <type_traits>

#include "worker/render/base/features.h"
#include "worker/render/media/medium.h"

namespace ls::render {

class OpticalDepth {
 public:
  struct Point {
    float t = 0;     // distance from the ray's origin [world units]
    float x = 0;     // density integrated from the ray's origin to t
    float rate = 0;  // dx / dt at t; 0 outside of the medium
    V3 index{0, 0, 0};
  };

  // Prepares the ray o + t d from t = 0 to t_max, which may be infinite. d has unit length.
  OpticalDepth(const Medium& m, const V3& o, const V3& d, float t_max)
      : medium_(&m), o_(o), d_(d), t_max_(t_max), to_(t_max), total_(t_max) {
    if (m.grid) measure();
  }

  // The part [from(), to()] of the ray contains all of the medium that the ray meets. to() is infinite if
  // neither the ray nor the medium ends.
  float from() const { return from_; }
  float to() const { return to_; }
  // The value of x at to(). It is 0 if the ray misses the medium.
  float total() const { return total_; }

  Point at(float t) const { return medium_->grid ? grid_at(t) : Point{t, t, 1, {0, 0, 0}}; }
  Point after(float x) const { return medium_->grid ? grid_after(x) : Point{x, x, 1, {0, 0, 0}}; }

  // Sets x[i] to the density integrated up to t[i], for ascending t, by one traversal.
  void at_each(std::span<const float> t, std::span<double> x) const;

  // Returns the scattering coefficients [1/world unit] at `at_point`, whose position in the world is p.
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

// OpticalDepth for a medium that is known to be homogeneous: the same interface, but no cells to traverse.
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
