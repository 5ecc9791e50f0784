// Integrals over the visible normals of microfacets, by Gauss-Legendre quadrature in double.
#pragma once

#include <vector>

#include "common/scene/scene.h"

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

}  // namespace ls::render
