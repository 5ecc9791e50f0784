#include "worker/render/bsdf/microfacet_tables.h"

#include <algorithm>
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

// Light comes from the direction (sin, 0, cos) and meets a microfacet with the normal (mx, my, mz). Returns
// the share of it that the facet reflects or refracts (`way`), times the masking of the light's new
// direction.
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
  // Sine and cosine of the viewer's direction in the space that is stretched so that the roughness is 1
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
        // The visible normals of GGX correspond to a cap of the unit sphere (Dupuy and Benyoub 2023). The cap
        // is symmetric in y, so its half with y >= 0 suffices.
        x = alpha * (r * q.cos[b] + is), y = alpha * r * q.sin[b], z = cap + ic;
      }
      const double n = 1 / std::sqrt(x * x + y * y + z * z);
      row += q.w[b] * sent_on(way, type, alpha, eta, sin, mu, x * n, y * n, z * n);
    }
    sum += q.w[a] * row;
  }
  return sum;
}

namespace {

// The nodes of a table are cosines. At first they are 0 and the powers of two from 2^-kOctaves to 1; they are
// dense near 0 because there the functions vary on the scale of the roughness alpha, which is at least
// kSpecularAlpha. The intervals are halved until the error is small enough, but at most kDeepest times: the
// error of linear interpolation falls with the square of the width, so with 2^12 parts it reaches the
// resolution of float32. A table with kMostEntries entries is not refined further: at extreme roughnesses the
// functions are rounding noise, and no refinement would make the error small.
constexpr int kOctaves = 16, kDeepest = 12;
constexpr std::size_t kMostEntries = 1024;

const Quadrature& quadrature(double eta, Accuracy accuracy) {
  static const Quadrature kSmooth = gauss_legendre(64), kKinked = gauss_legendre(128),
                          kRough = gauss_legendre(24), kRoughKinked = gauss_legendre(48);
  // If eta < 1, the integrand has a kink where total reflection begins, so more nodes are needed
  if (accuracy == Accuracy::rough) return eta >= 1 ? kRough : kRoughKinked;
  return eta >= 1 ? kSmooth : kKinked;
}
double tolerance(Accuracy accuracy) {
  return accuracy == Accuracy::full ? kEnergyTolerance : kTexturedEnergyTolerance / 4;
}

// The masking of the viewer in the BSDF's value, divided by the masking in the density of visible normals.
// The ratio is not 1 for Beckmann, whose value uses a fit (microfacet.h).
double fit(Microfacet type, double alpha, double mu) {
  if (type == Microfacet::ggx || alpha < kSpecularAlpha) return 1;
  const V3 w(static_cast<float>(std::sqrt((1 - mu) * (1 + mu))), 0, static_cast<float>(mu));
  const auto a = static_cast<float>(alpha);
  return double{beckmann::G1_over_cos(w, a, a)} / double{beckmann::exact_G1_over_cos(w, a, a)};
}

double share(Way way, Microfacet type, double alpha, double eta, double mu,
             Accuracy accuracy = Accuracy::full) {
  const double safe = std::max(mu, 1e-6);
  return fit(type, alpha, safe) * rough_share(way, type, alpha, eta, safe, quadrature(eta, accuracy));
}
double both_ways(Microfacet type, double alpha, double eta, double mu, Accuracy accuracy = Accuracy::full) {
  return share(Way::reflected, type, alpha, eta, mu, accuracy) +
         share(Way::refracted, type, alpha, eta, mu, accuracy);
}
double lacking(double E) { return (1 - E) / E; }

}  // namespace

CosineTable::CosineTable(const std::function<double(double)>& f, double tolerance) {
  double x0 = 0, y0 = f(0);
  x_.push_back(0);
  y_.push_back(static_cast<float>(y0));
  for (int i = kOctaves; i >= 0; --i) {
    const double x1 = std::ldexp(1., -i), y1 = f(x1);
    refine(f, x0, y0, x1, y1, tolerance, 0);
    x0 = x1;
    y0 = y1;
  }
}

void CosineTable::refine(const std::function<double(double)>& f, double x0, double y0, double x1, double y1,
                         double tolerance, int depth) {
  double y[3];
  // An undivided octave (depth 0) is always halved: three points do not suffice to show that f is straight
  // there
  bool fine = depth > 0;
  for (int i = 0; i < 3; ++i) {
    const double t = .25 * (i + 1);
    y[i] = f(x0 + (x1 - x0) * t);
    fine = fine && std::abs(y[i] - (y0 + (y1 - y0) * t)) <= tolerance;
  }
  if (fine || depth == kDeepest || x_.size() >= kMostEntries) {
    x_.push_back(static_cast<float>(x1));
    y_.push_back(static_cast<float>(y1));
    return;
  }
  const double middle = .5 * (x0 + x1);
  refine(f, x0, y0, middle, y[1], tolerance, depth + 1);
  refine(f, middle, y[1], x1, y1, tolerance, depth + 1);
}

double CosineTable::mean() const {
  double sum = 0;
  for (std::size_t i = 1; i < x_.size(); ++i) {
    const double a = double{x_[i - 1]}, b = double{x_[i]}, p = double{y_[i - 1]}, q = double{y_[i]};
    // On each interval f is linear, so Simpson's rule is exact for f(x) x.
    sum += (b - a) / 6 * (a * p + 4 * (.5 * (a + b)) * (.5 * (p + q)) + b * q);
  }
  return 2 * sum;
}

MicrofacetEnergy conductor_energy(Microfacet type, double alpha, Accuracy accuracy) {
  MicrofacetEnergy e;
  e.missing =
      CosineTable([&](double mu) { return lacking(share(Way::mirrored, type, alpha, 1, mu, accuracy)); },
                  tolerance(accuracy));
  const CosineTable E([&](double mu) { return 1 / (1 + e.missing.at(static_cast<float>(mu))); },
                      tolerance(accuracy));
  e.mean = static_cast<float>(E.mean());
  return e;
}

MicrofacetEnergy dielectric_energy(Microfacet type, double alpha, double eta, Accuracy accuracy) {
  MicrofacetEnergy e;
  const auto table = [&](double index) {
    return CosineTable([=](double mu) { return lacking(both_ways(type, alpha, index, mu, accuracy)); },
                       tolerance(accuracy));
  };
  e.missing = table(eta);
  e.missing_behind = table(1 / eta);
  return e;
}

MicrofacetEnergy coat_energy(Microfacet type, double alpha, double eta) {
  MicrofacetEnergy e;
  e.missing =
      CosineTable([&](double mu) { return lacking(both_ways(type, alpha, eta, mu)); }, kEnergyTolerance);
  e.through = CosineTable(
      [&](double mu) {
        const double in = share(Way::refracted, type, alpha, eta, mu);
        return in / (in + share(Way::reflected, type, alpha, eta, mu));
      },
      kEnergyTolerance);
  return e;
}

C3 mean_fresnel(const C3& eta, const C3& k) {
  constexpr int kSteps = 1024;
  V3d sum(0, 0, 0);
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + .5) / kSteps;
    sum += V3d(fresnel_conductor(static_cast<float>(mu), eta, k)) * (2 * mu / kSteps);
  }
  return C3(sum);
}

float mean_fresnel(double eta) {
  constexpr int kSteps = 1024;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + .5) / kSteps;
    sum += fresnel_dielectric(mu, eta).reflectance * 2 * mu / kSteps;
  }
  return static_cast<float>(sum);
}

RoughPlasticTable make_rough_plastic_table(Microfacet type, double alpha, double eta) {
  static const Quadrature kOutside = gauss_legendre(48),
                          // kInside has more nodes: its integrands have a kink where total reflection begins
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
