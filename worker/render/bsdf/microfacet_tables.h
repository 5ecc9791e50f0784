// Integrals over the visible normals of microfacets, by Gauss-Legendre quadrature in double, and tables of
// these integrals for materials. "Index" is the index of refraction, "cosine" that of the angle to the
// surface normal.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

struct Quadrature {
  std::vector<double> x, w;             // nodes in [0, 1] and their weights
  std::vector<double> gauss, cos, sin;  // at each node x: erf^-1(2 x - 1), cos(pi x) and sin(pi x)
};
// Returns the Gauss-Legendre quadrature with n nodes on [0, 1].
Quadrature gauss_legendre(int n);

// The path of light that meets a microfacet. With F the Fresnel reflectance, the share F is reflected
// and 1 - F refracted. `mirrored` is reflection without loss: all light is reflected.
enum class Way { reflected, refracted, mirrored };

// Light meets a rough surface at the cosine mu. Returns the share of it that is sent on by `way` and leaves
// the surface after one bounce: the mean over the visible normals of the facet's share (see Way) times the
// masking of the new direction (for Beckmann by Mitsuba's fit). eta is the index on the other side over the
// index on the side of the incident light. If alpha < kSpecularAlpha, the surface is treated as a plane.
double rough_share(Way way, Microfacet type, double alpha, double eta, double mu, const Quadrature& q);

// A table of a function of a cosine in [0, 1]: piecewise linear, with adaptively placed nodes.
class CosineTable {
 public:
  CosineTable() = default;
  // Tabulates f with an error of at most `tolerance`. The error is checked at three points of each interval,
  // its middle and its quarter points. It may be larger where a table has reached its largest size.
  CosineTable(const std::function<double(double)>& f, double tolerance);

  float at(float x) const {
    const auto it = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
    const auto i = static_cast<std::size_t>(it - x_.begin());
    const float t = (x - x_[i - 1]) / (x_[i] - x_[i - 1]);
    return y_[i - 1] * (1 - t) + y_[i] * t;
  }
  // Returns the mean 2 int f(x) x dx over x from 0 to 1, where f is the piecewise linear function.
  double mean() const;
  std::size_t bytes() const { return (x_.size() + y_.size()) * sizeof(float); }

 private:
  void refine(const std::function<double(double)>& f, double x0, double y0, double x1, double y1,
              double tolerance, int depth);
  std::vector<float> x_, y_;
};

// The largest error of the compensated energy: in a white furnace (radiance 1 from all directions) a surface
// without absorption has the radiance 1 up to this error. It covers the errors of the tables and of the
// quadrature by which they are computed.
inline constexpr double kEnergyTolerance = 5e-4;
// The same for a surface of GGX facets whose roughness is a texture (EnergyByRoughness), up to the roughness
// sqrt(alpha) = 1: the error of interpolation between its tables.
inline constexpr double kTexturedEnergyTolerance = 5e-3;

// Single-scattering microfacet models lose the light that is scattered several times between microfacets.
// Here a factor on the BSDF f compensates for it (Turquin 2019, "Practical multiple scattering compensation
// for microfacet models"). Let E(mu) be the share of light that leaves after one bounce in the absence of
// absorption, for a viewer at the cosine mu. The compensated BSDF is
//
//   f' = f (1 + F' (1 - E) / E),   F' = F E_mean / (1 - F (1 - E_mean)),   E_mean = 2 int E mu dmu,
//
// where F is the mean Fresnel reflectance (times the tint). Masked light hits the surface again; each
// further bounce has the factor F (1 - E_mean), and F' is the sum of this series (Kulla and Conty 2017). If
// nothing is absorbed, that is, if F = 1, the factor restores exactly the missing energy. For a dielectric E
// includes reflection and refraction, and nothing is absorbed. The factor depends only on the viewer, so
// sampling does not change, and the BSDF is not reciprocal.
struct MicrofacetEnergy {
  // (1 - E) / E by the viewer's cosine: for viewers outside and, only for dielectrics, for viewers inside
  CosineTable missing, missing_behind;
  // Only for plastics. Light from outside that meets the coat is reflected or refracted by one facet, or lost
  // by masking. Of the light that is not lost, `through` is the refracted share, by cosine.
  CosineTable through;
  float mean = 1;  // E_mean; only for conductors

  // Returns the factor f' / f of a conductor whose mean Fresnel reflectance is F, for a viewer at the cosine
  // `cos`.
  C3 factor(float cos, const C3& F) const {
    const float lacking = missing.at(cos), lost = 1 - mean;
    const auto again = [&](float f) { return f * mean / (1 - f * lost); };
    return {1 + lacking * again(F.x), 1 + lacking * again(F.y), 1 + lacking * again(F.z)};
  }
  float factor(float cos, bool outside) const { return 1 + (outside ? missing : missing_behind).at(cos); }
  std::size_t bytes() const { return missing.bytes() + missing_behind.bytes() + through.bytes(); }
};

// How accurate a table is: its tolerance, and the number of nodes of the quadrature behind it (where light is
// totally reflected, twice as many).
enum class Accuracy { full, rough };
MicrofacetEnergy conductor_energy(Microfacet type, double alpha, Accuracy accuracy = Accuracy::full);
// eta is the index inside over the index outside.
MicrofacetEnergy dielectric_energy(Microfacet type, double alpha, double eta,
                                   Accuracy accuracy = Accuracy::full);
// Makes the tables for the coat of a rough plastic. Sets `missing` and `through`, and leaves `missing_behind`
// empty. eta is the index of the coat over the index outside.
MicrofacetEnergy coat_energy(Microfacet type, double alpha, double eta);

// The energies of GGX surfaces of every roughness r = sqrt(alpha) from 0 to 1: one table if the roughness is
// constant, else tables at equal steps of r, between which (1 - E) / E is interpolated linearly.
class EnergyByRoughness {
 public:
  static constexpr int kSteps = 24;

  EnergyByRoughness() = default;
  // `tables`: one, or those of the roughnesses i / kSteps for i from 0 to kSteps. They must outlive this
  // object.
  explicit EnergyByRoughness(std::vector<const MicrofacetEnergy*> tables) : tables_(std::move(tables)) {}

  bool empty() const { return tables_.empty(); }
  // Each returns what the function of this name of MicrofacetEnergy does, for the roughness r.
  C3 factor(float r, float cos, const C3& F) const {
    return between(r, [&](const MicrofacetEnergy& e) { return e.factor(cos, F); });
  }
  float factor(float r, float cos, bool outside) const {
    return between(r, [&](const MicrofacetEnergy& e) { return e.factor(cos, outside); });
  }

 private:
  template <class Value>
  std::invoke_result_t<Value, const MicrofacetEnergy&> between(float r, Value value) const {
    if (tables_.size() == 1) return value(*tables_[0]);
    const float x = std::clamp(r, 0.f, 1.f) * kSteps;
    const auto i = std::min(static_cast<std::size_t>(x), tables_.size() - 2);
    const float t = x - static_cast<float>(i);
    return value(*tables_[i]) * (1 - t) + value(*tables_[i + 1]) * t;
  }
  std::vector<const MicrofacetEnergy*> tables_;
};

// Returns the mean Fresnel reflectance of a conductor, 2 int F(mu) mu dmu over the cosine mu from 0 to 1, per
// channel. eta and k are the real and the imaginary part of its index.
C3 mean_fresnel(const C3& eta, const C3& k);
// The same of a dielectric seen from outside; eta is the index inside over the index outside.
float mean_fresnel(double eta);

// The tables of a coat over a metal that absorbs nothing, by the cosine outside the coat. T, F and Q are
// those of conductor.h: transmittance and reflectance of the coat for light from outside, and the share of
// light that stays in the coat after its first reflection by the metal.
struct CoatedConductorTables {
  CosineTable through, reflected;  // T and F; empty if the coat is smooth
  CosineTable staying;             // Q
  float staying_mean = 0;          // Q_mean = 2 int Q(mu) mu dmu
  // Shares of diffuse light inside the coat. Of the light that meets the coat, the share `internal` is
  // reflected and the share `leaving` is transmitted. Of the light that meets the metal, the share
  // `metal_albedo` is reflected; the metal's facets mask the rest.
  float internal = 0, leaving = 1, metal_albedo = 1;
};

inline constexpr int kPlasticNodes = 64;

// Transmittance of the dielectric coat of rough plastic, averaged over its microfacets.
struct RoughPlasticTable {
  // Entry i is the transmittance for light from outside at the cosine i / (kPlasticNodes - 1); between the
  // entries it is interpolated linearly.
  std::array<float, kPlasticNodes> transmittance{};
  float internal_reflectance = 0;  // reflectance for diffuse light from inside

  float at(float cos_theta) const {
    const float x = cos_theta * (kPlasticNodes - 1);
    const int i = x < kPlasticNodes - 2 ? static_cast<int>(x) : kPlasticNodes - 2;
    const float t = x - static_cast<float>(i);
    return transmittance[i] * (1 - t) + transmittance[i + 1] * t;
  }
};

// Returns the table of Mitsuba's rough plastic. Mitsuba defines the nodes mu_i, the linear interpolation
// between them, and the internal reflectance: twice the mean of R(mu_i) mu_i over the nodes, with R the
// reflectance for light from inside (a plain mean, about 0.009 below the integral). Transmittance and R at a
// node are integrals over visible normals, by Gauss-Legendre quadrature in double, of the facet's
// transmittance or reflectance times the masking of the new direction (rough_share()). If alpha is below
// kSpecularAlpha, the coat is smooth. eta is the index inside over the index outside.
RoughPlasticTable make_rough_plastic_table(Microfacet type, double alpha, double eta);

}  // namespace ls::render
