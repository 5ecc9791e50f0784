#include "worker/render/bsdf/rough_plastic_table.h"

#include <algorithm>

#include "worker/render/bsdf/visible_normals.h"

namespace ls::render {

RoughPlasticTable make_rough_plastic_table(Microfacet type, double alpha, double eta) {
  static const Quadrature kOutside = gauss_legendre(48),
                          // More nodes inside: the integrand has a kink where total reflection begins
      kInside = gauss_legendre(96);
  RoughPlasticTable t;
  double internal = 0;
  for (int i = 0; i < kPlasticNodes; ++i) {
    const double mu = std::max(1e-6, i / (kPlasticNodes - 1.));
    t.transmittance[i] =
        static_cast<float>(rough_share(Way::refracted, type, alpha, eta, mu, eta > 1 ? kOutside : kInside));
    internal += mu * rough_share(Way::reflected, type, alpha, 1 / eta, mu, eta > 1 ? kInside : kOutside);
  }
  t.internal_reflectance = static_cast<float>(2 * internal / kPlasticNodes);
  return t;
}

}  // namespace ls::render
