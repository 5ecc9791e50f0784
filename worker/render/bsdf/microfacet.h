// Beckmann and GGX microfacets, anisotropic, with separable Smith masking G = G1(wi) G1(wo), as in Mitsuba.
// All directions are unit vectors in the local frame, above the surface (z > 0). The functions return G1 /
// cos, and densities divided by D, so that callers need not divide by a cosine. ax and ay are the roughnesses
// (alpha) along x and y.
//
// The *value* of a Beckmann BSDF uses Walter's rational fit of G1 (relative error below 0.35 %), as in
// Mitsuba. The *density* of sampling uses the exact G1, since the density must be exact.
#pragma once

#include "core/scene/scene.h"
#include "worker/render/math/math.h"

namespace ls::render {

// If both roughnesses are below kSpecularAlpha, the surface is a perfect mirror. If not, a roughness below
// kMinAlpha is raised to kMinAlpha.
inline constexpr float kSpecularAlpha = 1e-3f;
inline constexpr float kMinAlpha = 1e-4f;

// Returns the length of the tangential part of w after stretching w to (ax x, ay y, z). In the stretched
// space the surface has roughness 1.
inline float stretched_sine(const V3& w, float ax, float ay) {
  return std::sqrt(sqr(ax * w.x) + sqr(ay * w.y));
}

namespace ggx {
// The density of microfacet normals m. It is computed from x and y of m instead of 1 - z^2, which would
// cancel where m is near the surface normal.
inline float D(const V3& m, float ax, float ay) {
  return 1 / (kPi * ax * ay * sqr(sqr(m.x / ax) + sqr(m.y / ay) + m.z * m.z));
}
inline float G1_over_cos(const V3& w, float ax, float ay) {
  return 2 / (w.z + std::sqrt(sqr(ax * w.x) + sqr(ay * w.y) + w.z * w.z));
}
// The factor k of bounded visible normals (Tokuyoshi and Eto 2024). It reduces the part of the sampled
// spherical cap below the horizon, so that fewer of the sampled normals reflect wo downwards.
inline float bound_k(const V3& wo, float ax, float ay) {
  const float a = std::min(std::min(ax, ay), 1.f), s = 1 + std::sqrt(wo.x * wo.x + wo.y * wo.y);
  return (1 - a * a) * s * s / (s * s + a * a * wo.z * wo.z);
}
// The density of the direction into which sample_normal() with k = bound_k() reflects wo, divided by D(m).
inline float pdf_over_D(const V3& wo, float ax, float ay) {
  const float t = std::sqrt(sqr(ax * wo.x) + sqr(ay * wo.y) + wo.z * wo.z);
  return .5f / (bound_k(wo, ax, ay) * wo.z + t);
}
// Samples a microfacet normal that is visible from wo. u is in [0, 1)^2. If k is 1, all visible normals are
// sampled; if it is bound_k(), many of those that reflect wo downwards are left out.
inline V3 sample_normal(const V3& wo, float ax, float ay, const V2& u, float k) {
  const V3 i = normalize(V3(ax * wo.x, ay * wo.y, wo.z));
  const float b = k * i.z;
  const float z = (1 - u.y) * (1 + b) - b, r = safe_sqrt((1 - z) * (1 + z));
  const V2 c = unit_circle(u.x) * r;
  const V3 m = V3(c.x, c.y, z) + i;
  return normalize(V3(ax * m.x, ay * m.y, std::max(m.z, 0.f)));
}
}  // namespace ggx

namespace beckmann {
inline float D(const V3& m, float ax, float ay) {
  const float c2 = m.z * m.z, e = (sqr(m.x / ax) + sqr(m.y / ay)) / c2;
  // If c2 = 0, e is NaN or infinite; the comparison is then false and the result is 0
  return e < 87 ? std::exp(-e) / (kPi * ax * ay * c2 * c2) : 0;
}
inline float G1_over_cos(const V3& w, float ax, float ay) {
  const float s = stretched_sine(w, ax, ay);
  if (w.z >= 1.6f * s) return 1 / w.z;
  const float a = w.z / s;
  return (3.535f + 2.181f * a) / ((1 + a * (2.276f + 2.577f * a)) * s);
}
// The exact G1 / cos. It is 1 / A, where A is the area of the microfacets that face w, projected along w, per
// area of the surface.
inline float exact_G1_over_cos(const V3& w, float ax, float ay) {
  const float s = stretched_sine(w, ax, ay);
  if (w.z > 6 * s) return 1 / w.z;  // in float32 erf(6) is 1, and exp(-36) is negligible
  const float a = w.z / s;
  return 1 /
         (.5f * w.z * (1 + std::erf(a)) + s * std::exp(-a * a) * .28209479177387814f);  // 1 / (2 sqrt(pi))
}
inline float pdf_over_D(const V3& wo, float ax, float ay) { return .25f * exact_G1_over_cos(wo, ax, ay); }
// Samples a microfacet normal that is visible from wo, by inversion, in double; u is in [0, 1)^2.
V3 sample_normal(const V3& wo, float ax, float ay, const V2& u);
// Samples the slope of a visible microfacet along the viewing direction, for roughness 1: returns the slope
// at which the cumulative distribution of visible slopes is u. theta is the angle between viewer and normal.
double visible_slope(double cos_theta, double sin_theta, double u);
double erf_inverse(double x);
}  // namespace beckmann

struct Microfacets {
  Microfacet type = Microfacet::ggx;
  float ax = .1f, ay = .1f;

  float D(const V3& m) const { return type == Microfacet::ggx ? ggx::D(m, ax, ay) : beckmann::D(m, ax, ay); }
  float G1_over_cos(const V3& w) const {
    return type == Microfacet::ggx ? ggx::G1_over_cos(w, ax, ay) : beckmann::G1_over_cos(w, ax, ay);
  }
  float pdf_over_D(const V3& wo) const {
    return type == Microfacet::ggx ? ggx::pdf_over_D(wo, ax, ay) : beckmann::pdf_over_D(wo, ax, ay);
  }
  V3 sample_normal(const V3& wo, const V2& u) const {
    return type == Microfacet::ggx ? ggx::sample_normal(wo, ax, ay, u, ggx::bound_k(wo, ax, ay))
                                   : beckmann::sample_normal(wo, ax, ay, u);
  }
  // Samples any visible normal m, with the density D(m) visible_over_D(wo) dot(wo, m). Refraction needs this,
  // because it also uses normals that would reflect wo downwards.
  V3 sample_visible(const V3& wo, const V2& u) const {
    return type == Microfacet::ggx ? ggx::sample_normal(wo, ax, ay, u, 1)
                                   : beckmann::sample_normal(wo, ax, ay, u);
  }
  float visible_over_D(const V3& wo) const {
    return type == Microfacet::ggx ? ggx::G1_over_cos(wo, ax, ay) : beckmann::exact_G1_over_cos(wo, ax, ay);
  }
};

}  // namespace ls::render
