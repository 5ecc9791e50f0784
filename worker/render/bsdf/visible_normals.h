// Integrals over the visible normals of microfacets, by Gauss-Legendre quadrature in double.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace ls::render {

struct Quadrature {
  std::vector<double> x, w;             // on [0, 1]
  std::vector<double> gauss, cos, sin;  // at the nodes: the inverse of the error function of 2 x - 1; of pi x
};
// Of n nodes.
Quadrature gauss_legendre(int n);

// What a microfacet does: reflects with weight F, refracts with 1 - F, or reflects all.
enum class Way { reflected, refracted, mirrored };

// The share of the light seen at the cosine mu that leaves this way and is not masked then: the mean over the
// visible normals of the weight times the masking of the new direction (the dialect's, for Beckmann a fit).
// eta: the index beyond over the index here. alpha < kSpecularAlpha: of a plane.
double rough_share(Way way, Microfacet type, double alpha, double eta, double mu, const Quadrature& q);

}  // namespace ls::render
