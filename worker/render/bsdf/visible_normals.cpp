#include "worker/render/bsdf/visible_normals.h"

#include <cmath>
#include <utility>

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"

namespace ls::render {

// The nodes are the roots of the Legendre polynomial P_n, found by Newton's method from Tricomi's estimate.
Quadrature gauss_legendre(int n) {
  Quadrature q;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(M_PI * (i + .75) / (n + .5)), dp = 0;
    for (int step = 0; step < 8; ++step) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) p0 = std::exchange(p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k);
      dp = n * (x * p1 - p0) / (x * x - 1);
      x -= p1 / dp;
    }
    q.x.push_back(.5 * (1 - x));
    q.w.push_back(1 / ((1 - x * x) * dp * dp));
    q.gauss.push_back(beckmann::erf_inverse(2 * q.x.back() - 1));
    q.cos.push_back(std::cos(M_PI * q.x.back()));
    q.sin.push_back(std::sin(M_PI * q.x.back()));
  }
  return q;
}

namespace {

double masking(Microfacet type, double alpha, double x, double y, double z) {
  const double s = alpha * std::hypot(x, y);
  if (type == Microfacet::ggx) return 2 * z / (z + std::hypot(s, z));
  if (z >= 1.6 * s) return 1;
  const double a = z / s;
  return a * (3.535 + 2.181 * a) / (1 + a * (2.276 + 2.577 * a));
}

// Returns the share of the light from i = (sin, 0, cos) that a microfacet with the normal m = (mx, my, mz)
// sends on by `way`, times the masking of the new direction.
double sent_on(Way way, Microfacet type, double alpha, double eta, double sin, double cos, double mx,
               double my, double mz) {
  const double im = sin * mx + cos * mz;
  if (!(im > 0)) return 0;
  const DielectricFresnel f = fresnel_dielectric(im, eta);
  const bool up = way != Way::refracted;
  const double along_m = up ? 2 * im : im * f.eta_ti + f.cos_t, along_i = up ? 1 : f.eta_ti;
  const double ox = along_m * mx - along_i * sin, oy = along_m * my, oz = along_m * mz - along_i * cos;
  const double share = way == Way::mirrored ? 1 : up ? f.reflectance : 1 - f.reflectance;
  if (share <= 0 || !((up ? oz : -oz) > 0)) return 0;
  return share * masking(type, alpha, ox, oy, std::abs(oz));
}

}  // namespace

double rough_share(Way way, Microfacet type, double alpha, double eta, double mu, const Quadrature& q) {
  if (alpha < kSpecularAlpha) {
    const double R = fresnel_dielectric(mu, eta).reflectance;
    return way == Way::mirrored ? 1 : way == Way::reflected ? R : 1 - R;
  }
  const double sin = std::sqrt(1 - mu * mu), l = std::hypot(alpha * sin, mu);
  // The direction of the viewer in the space where the roughness is 1
  const double is = alpha * sin / l, ic = mu / l;
  double sum = 0;
  for (std::size_t a = 0; a < q.x.size(); ++a) {
    double x, y, z, row = 0;
    const double slope = type == Microfacet::beckmann ? beckmann::visible_slope(ic, is, q.x[a]) : 0;
    const double cap = (1 - q.x[a]) * (1 + ic) - ic, r = safe_sqrt((1 - cap) * (1 + cap));
    for (std::size_t b = 0; b < q.x.size(); ++b) {
      if (type == Microfacet::beckmann) {
        x = -alpha * slope, y = alpha * q.gauss[b], z = 1;
      } else {
        // The visible normals of GGX are a cap of the sphere (Dupuy and Benyoub 2023). Its two halves are
        // equal, so one of them suffices.
        x = alpha * (r * q.cos[b] + is), y = alpha * r * q.sin[b], z = cap + ic;
      }
      const double n = 1 / std::sqrt(x * x + y * y + z * z);
      row += q.w[b] * sent_on(way, type, alpha, eta, sin, mu, x * n, y * n, z * n);
    }
    sum += q.w[a] * row;
  }
  return sum;
}

}  // namespace ls::render
