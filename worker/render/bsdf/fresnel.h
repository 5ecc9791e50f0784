// Fresnel reflectances for unpolarised light.
#pragma once

#include "worker/render/math/math.h"

namespace ls::render {

struct DielectricFresnel {
  double reflectance = 0;
  // Cosine of the refracted direction, with the sign opposite to cos_i; 0 under total internal reflection.
  double cos_t = 0;
  double eta_it = 1;  // index on the transmitted side over the index on the incident side
  double eta_ti = 1;  // 1 / eta_it
};

// Computes reflectance and refraction at a smooth boundary of two dielectrics. cos_i is the cosine of the
// angle between the outward normal and the direction towards the incident light; it is positive if the light
// comes from the outside. eta is the index inside over the index outside. All is computed in double, because
// the terms of the amplitudes cancel where eta is near 1.
inline DielectricFresnel fresnel_dielectric(double cos_i, double eta) {
  const bool outside = cos_i >= 0;
  DielectricFresnel f;
  f.eta_it = outside ? eta : 1 / eta;
  f.eta_ti = outside ? 1 / eta : eta;
  if (eta == 1) return {0, -cos_i, 1, 1};
  const double c = std::abs(cos_i);
  const double cos_t2 = 1 - (1 - c) * (1 + c) * f.eta_ti * f.eta_ti;
  if (cos_t2 <= 0) {
    f.reflectance = 1;
    return f;
  }
  const double t = std::sqrt(cos_t2);
  const double rs = (c - f.eta_it * t) / (c + f.eta_it * t), rp = (f.eta_it * c - t) / (f.eta_it * c + t);
  f.reflectance = .5 * (rs * rs + rp * rp);
  f.cos_t = outside ? -t : t;
  return f;
}

// Returns the reflectance of a smooth boundary for diffuse light from inside. eta is the index inside over
// the index outside. First the reflectance for diffuse light from the side with the lower index is computed.
// It is twice the integral of F(mu) mu over the cosine mu from 0 to 1, with F the Fresnel reflectance. On
// this side there is no total reflection and F is smooth, so Simpson's rule has a relative error below 1e-7.
// The reflectance for light from the other side follows by reciprocity.
inline double internal_diffuse_reflectance(double eta) {
  const double n = std::max(eta, 1 / eta);
  constexpr int kSteps = 256;
  double sum = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double mu = static_cast<double>(i) / kSteps, weight = i == kSteps ? 1 : i % 2 ? 4 : 2;
    sum += weight * 2 * mu * fresnel_dielectric(mu, n).reflectance;
  }
  const double into_denser = sum / (3 * kSteps);
  return eta >= 1 ? 1 - (1 - into_denser) / (n * n) : into_denser;
}

// Returns the reflectance of a conductor whose complex index, relative to the outside, is eta + i k, for the
// cosine of incidence cos_i in [0, 1]. With eta = 0 everything is reflected.
inline float fresnel_conductor(float cos_i, float eta, float k) {
  const float c2 = cos_i * cos_i, s2 = (1 - cos_i) * (1 + cos_i);
  // t1 is eta^2 - k^2 - s2, in a form that is accurate even where it nearly vanishes.
  const float t1 = (eta - 1) * (eta + 1) - k * k + c2;
  const float a2b2 = safe_sqrt(t1 * t1 + 4 * k * k * eta * eta);
  const float a = safe_sqrt(.5f * (a2b2 + t1));
  const float p = a2b2 + c2, q = 2 * cos_i * a;
  if (!(p + q > 0)) return 1;
  // p - q is >= 0, but for an index near 1 rounding may make it negative
  const float rs = std::max(0.f, p - q) / (p + q);
  const float u = a2b2 * c2 + s2 * s2, v = q * s2;
  if (!(u + v > 0)) return rs;  // happens if eta = k = 0 at normal incidence
  return .5f * (rs + rs * (u - v) / (u + v));
}
inline C3 fresnel_conductor(float cos_i, const C3& eta, const C3& k) {
  return {fresnel_conductor(cos_i, eta.x, k.x), fresnel_conductor(cos_i, eta.y, k.y),
          fresnel_conductor(cos_i, eta.z, k.z)};
}

}  // namespace ls::render
