// Integrals over the visible normals of microfacets, by Gauss-Legendre quadrature in double.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace ls::render {

struct Quadrature {
  std::vector<double> x, w;             // on [0, 1]
  std::vector<double> gauss, cos, sin;  // at the nodes: erf^-1(2 x - 1); cosine and sine of pi x
};
// The quadrature with n nodes.
Quadrature gauss_legendre(int n);

// The weight of a microfacet: F (reflected), 1 - F (refracted), or 1 (mirrored).
enum class Way { reflected, refracted, mirrored };

// The share of light seen at the cosine mu that leaves this way without being masked: the mean over visible
// normals of the weight times the masking of the new direction (for Beckmann the dialect's fit). eta: the
// index beyond over the index on this side. alpha < kSpecularAlpha: a plane.
double rough_share(Way way, Microfacet type, double alpha, double eta, double mu, const Quadrature& q);

}  // namespace ls::render
