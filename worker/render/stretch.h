// What a ray meets of a medium, measured so that the medium looks homogeneous: `x` grows with the density
// that has been passed, and light of channel c fades by about exp(-sigma_t[c] x). In a homogeneous medium x
// is the length itself and that is exact. In a grid it is the integral over the macro cells' mean densities;
// the cells are walked anew for every question (a few nanoseconds a cell), nothing is stored.
#pragma once

#include <type_traits>

#include "worker/render/features.h"
#include "worker/render/medium.h"

namespace ls::render {

class Stretch {
 public:
  struct Spot {
    float t = 0;     // along the ray
    float x = 0;     // what has been passed
    float rate = 0;  // dx / dt; 0 where there is nothing of the medium
    V3 index{0, 0, 0};
  };

  // Along o + t d, d of unit length, up to t_max, which may be infinite.
  Stretch(const Medium& m, const V3& o, const V3& d, float t_max)
      : medium_(&m), o_(o), d_(d), t_max_(t_max), to_(t_max), total_(t_max) {
    if (m.grid) measure();
  }

  // The part of the ray outside of which nothing scatters; to() is infinite where the medium has no end.
  float from() const { return from_; }
  float to() const { return to_; }
  // What is passed up to to(). 0: nothing of the medium is met.
  float total() const { return total_; }

  Spot at(float t) const { return medium_->grid ? grid_at(t) : Spot{t, t, 1, {0, 0, 0}}; }
  Spot after(float x) const { return medium_->grid ? grid_after(x) : Spot{x, x, 1, {0, 0, 0}}; }

  // Scattering coefficients there; p is the spot in the world.
  C3 scattering(const Spot& spot, const V3& p) const {
    return medium_->grid ? grid_scattering(spot, p) : medium_->sigma_s;
  }

 private:
  void measure();
  C3 grid_scattering(const Spot& spot, const V3& p) const;
  Spot grid_at(float t) const;
  Spot grid_after(float x) const;

  const Medium* medium_;
  V3 o_, d_;
  float t_max_, from_ = 0, to_, total_;
};

// The same of a medium that is known to be homogeneous, where nothing is to be measured.
class PlainStretch {
 public:
  PlainStretch(const Medium& m, const V3&, const V3&, float t_max) : sigma_s_(m.sigma_s), t_max_(t_max) {}
  static float from() { return 0; }
  float to() const { return t_max_; }
  float total() const { return t_max_; }
  static Stretch::Spot at(float t) { return {t, t, 1, {0, 0, 0}}; }
  static Stretch::Spot after(float x) { return {x, x, 1, {0, 0, 0}}; }
  C3 scattering(const Stretch::Spot&, const V3&) const { return sigma_s_; }

 private:
  C3 sigma_s_;
  float t_max_;
};
template <Features F>
using StretchIn = std::conditional_t<F.grids, Stretch, PlainStretch>;

}  // namespace ls::render
