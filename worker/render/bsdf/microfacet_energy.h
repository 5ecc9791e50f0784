// The light that microfacets throw onto each other, which a model of single scattering loses, brought back
// by a factor on what it has (Turquin 2019, "Practical multiple scattering compensation for microfacet
// models"): with E(mu) the share that leaves after one bounce, seen at the cosine mu, where nothing absorbs,
//
//   f' = f (1 + F' (1 - E) / E),   F' = F E_mean / (1 - F (1 - E_mean)),   E_mean = 2 int E mu dmu,
//
// F the mean Fresnel reflectance (times the tint): what is not masked at last has met the surface once more
// for each factor F (1 - E_mean) (Kulla and Conty 2017). What absorbs nothing, F = 1, gets exactly what it
// lacks. At a dielectric E counts both ways, reflected and refracted, and nothing absorbs. The factor depends
// on the viewer alone: sampling does not change, and light does not go both ways alike.
#pragma once

#include <functional>
#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math.h"

namespace ls::render {

// A function on [0, 1], linear between nodes as dense as its shape asks for.
class CosineTable {
 public:
  CosineTable() = default;
  // Off by `tolerance` at most, at the middles and quarters of each interval.
  CosineTable(const std::function<double(double)>& f, double tolerance);

  float at(float x) const {
    const auto it = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
    const auto i = static_cast<std::size_t>(it - x_.begin());
    const float t = (x - x_[i - 1]) / (x_[i] - x_[i - 1]);
    return y_[i - 1] * (1 - t) + y_[i] * t;
  }
  double mean() const;  // 2 int f x dx, of the lines
  std::size_t bytes() const { return (x_.size() + y_.size()) * sizeof(float); }

 private:
  void refine(const std::function<double(double)>& f, double x0, double y0, double x1, double y1,
              double tolerance, int depth);
  std::vector<float> x_, y_;
};

// How far a white furnace may be from 1: the tables' tolerance, and that of the quadrature behind them.
inline constexpr double kEnergyTolerance = 5e-4;

struct MicrofacetEnergy {
  CosineTable missing, missing_behind;  // (1 - E) / E seen from outside and, of dielectrics, from inside
  CosineTable through;                  // plastics: what the coat lets in, brought up likewise
  float mean = 1;                       // conductors: E_mean

  // Of a metal with this mean reflectance.
  C3 factor(float cos, const C3& F) const {
    const float lacking = missing.at(cos), lost = 1 - mean;
    const auto again = [&](float f) { return f * mean / (1 - f * lost); };
    return {1 + lacking * again(F.x), 1 + lacking * again(F.y), 1 + lacking * again(F.z)};
  }
  float factor(float cos, bool outside) const { return 1 + (outside ? missing : missing_behind).at(cos); }
  std::size_t bytes() const { return missing.bytes() + missing_behind.bytes() + through.bytes(); }
};

MicrofacetEnergy conductor_energy(Microfacet type, double alpha);
// eta: inside over outside.
MicrofacetEnergy dielectric_energy(Microfacet type, double alpha, double eta);
// With `through` and without what is seen from inside.
MicrofacetEnergy coat_energy(Microfacet type, double alpha, double eta);

// 2 int F mu dmu of a conductor.
C3 mean_fresnel(const C3& eta, const C3& k);

}  // namespace ls::render
