// Transmittance of the dielectric coat of rough plastic, averaged over its microfacets.
#pragma once

#include <array>

#include "common/scene/scene.h"

namespace ls::render {

inline constexpr int kPlasticNodes = 64;

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
// transmittance or reflectance times the masking of the new direction (visible_normals.h). If alpha is below
// kSpecularAlpha, the coat is smooth. eta is the index inside over the index outside.
RoughPlasticTable make_rough_plastic_table(Microfacet type, double alpha, double eta);

}  // namespace ls::render
