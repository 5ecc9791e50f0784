#include "worker/render/bsdf/microfacet.h"

namespace ls::render::beckmann {

// The inverse of erf by the single precision polynomials of M. Giles, "Approximating the erfinv function"
// (2010): relative error below 1e-6.
double erf_inverse(double x) {
  double w = -std::log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5;
    p = 2.81022636e-08;
    for (const double c : {3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087, -0.00125372503,
                           -0.00417768164, 0.246640727, 1.50140941})
      p = c + p * w;
  } else {
    w = std::sqrt(w) - 3;
    p = -0.000200214257;
    for (const double c : {0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773, -0.0076224613,
                           0.00943887047, 1.00167406, 2.83297682})
      p = c + p * w;
  }
  return p * x;
}

// Let theta be the angle between the viewer and the normal, and cos, sin and cot the functions of theta. The
// slopes s that are visible are at most cot = cos / sin. Their density is proportional to the function
// exp(-s^2) (cos - s sin), whose integral from minus infinity to s is
//   H(s) = cos sqrt(pi)/2 (1 + erf s) + sin/2 exp(-s^2).
// The result s is the solution of H(s) = u H(cot). It is found by Newton's method inside a bracket, which
// each of at most 64 steps shrinks. A step that would leave the bracket is replaced by one to its middle; 64
// halvings reduce the bracket to the resolution of a double.
double visible_slope(double cos_theta, double sin_theta, double u) {
  constexpr double kHalfSqrtPi = .886226925452758014;
  // Slopes below -kEnd have a probability below exp(-42), which is less than any random number u > 0.
  constexpr double kEnd = 6.5;
  const auto H = [&](double s, double e) {
    return cos_theta * kHalfSqrtPi * std::erfc(-s) + .5 * sin_theta * e;
  };
  double lo = -kEnd, hi = cos_theta < kEnd * sin_theta ? cos_theta / sin_theta : kEnd;
  const double target = u * H(hi, std::exp(-hi * hi));
  double s = std::clamp(erf_inverse(std::clamp(2 * u - 1, -1 + 1e-12, 1 - 1e-12)), lo, hi);
  for (int i = 0; i < 64; ++i) {
    const double e = std::exp(-s * s), excess = H(s, e) - target;
    (excess > 0 ? hi : lo) = s;
    const double slope = e * (cos_theta - s * sin_theta);
    double next = s - excess / slope;
    if (!(next > lo && next < hi)) next = .5 * (lo + hi);
    if (std::abs(next - s) <= 1e-9 * (1 + std::abs(next))) return next;
    s = next;
  }
  return s;
}

V3 sample_normal(const V3& wo, float ax, float ay, const V2& u) {
  const double x = double{ax} * wo.x, y = double{ay} * wo.y, z = wo.z;
  const double r = std::sqrt(x * x + y * y), l = std::sqrt(r * r + z * z);
  const double cos_phi = r > 0 ? x / r : 1, sin_phi = r > 0 ? y / r : 0;
  const double along = visible_slope(z / l, r / l, u.x);
  const double across = erf_inverse(std::clamp(2. * u.y - 1, -1 + 1e-12, 1 - 1e-12));
  const double sx = ax * (cos_phi * along - sin_phi * across), sy = ay * (sin_phi * along + cos_phi * across);
  const double n = 1 / std::sqrt(1 + sx * sx + sy * sy);
  return {static_cast<float>(-sx * n), static_cast<float>(-sy * n), static_cast<float>(n)};
}

}  // namespace ls::render::beckmann
