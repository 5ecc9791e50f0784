// Integrals over the visible normals of microfacets, by Gauss-Legendre quadrature in double, and the tables
// that materials make of them.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

struct Quadrature {
  std::vector<double> x, w;             // nodes and weights on [0, 1]
  std::vector<double> gauss, cos, sin;  // functions of the nodes: erf^-1(2 x - 1); cosine and sine of pi x
};
// Returns the Gauss-Legendre quadrature with n nodes on [0, 1].
Quadrature gauss_legendre(int n);

// The interaction of light with a microfacet. It determines the facet's weight: F (reflected), 1 - F
// (refracted), or 1 (mirrored, that is, reflected without loss). F is the Fresnel reflectance.
enum class Way { reflected, refracted, mirrored };

// Returns the share of light incident at the cosine mu that leaves by `way` after one bounce without being
// masked: the mean over visible normals of the weight times the masking of the new direction (for Beckmann by
// Mitsuba's fit). eta is the index on the other side over the index on the side of the incident light. If
// alpha < kSpecularAlpha, the surface is a plane.
double rough_share(Way way, Microfacet type, double alpha, double eta, double mu, const Quadrature& q);

// A table of a function of a cosine in [0, 1]: piecewise linear, with adaptively placed nodes.
class CosineTable {
 public:
  CosineTable() = default;
  // Tabulates f. The error is at most `tolerance`, checked at the middle and the quarter points of each
  // interval.
  CosineTable(const std::function<double(double)>& f, double tolerance);

  float at(float x) const {
    const auto it = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
    const auto i = static_cast<std::size_t>(it - x_.begin());
    const float t = (x - x_[i - 1]) / (x_[i] - x_[i - 1]);
    return y_[i - 1] * (1 - t) + y_[i] * t;
  }
  double mean() const;  // 2 int f x dx of the piecewise linear function
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
  CosineTable missing, missing_behind;  // (1 - E) / E seen from outside and, for dielectrics, from inside
  // For plastics: the share of light that enters through the coat, compensated in the same way
  CosineTable through;
  float mean = 1;  // for conductors: E_mean

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

MicrofacetEnergy conductor_energy(Microfacet type, double alpha);
// eta is the index inside over the index outside.
MicrofacetEnergy dielectric_energy(Microfacet type, double alpha, double eta);
// Makes the tables for the coat of a rough plastic. Sets `through`, and leaves `missing_behind` empty.
MicrofacetEnergy coat_energy(Microfacet type, double alpha, double eta);

// Returns the mean Fresnel reflectance 2 int F mu dmu of a conductor, per channel.
C3 mean_fresnel(const C3& eta, const C3& k);

// The tables of a coat over a metal that absorbs nothing (conductor.h).
struct CoatedConductorTables {
  CosineTable through, reflected;  // T and F over the cosine outside; only of a rough coat
  CosineTable staying;             // Q
  float staying_mean = 0;          // 2 int Q mu dmu
  // Shares of diffuse light inside the coat: the coat reflects `internal` and transmits `leaving`, and a
  // metal that absorbs nothing reflects `metal_albedo`, since its facets mask the rest.
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
