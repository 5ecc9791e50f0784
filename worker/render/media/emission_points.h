// Sampling of the points on a ray interval at which medium emission is evaluated (emission.cpp).
#pragma once

#include <algorithm>
#include <cmath>

namespace ls::render {

// (1 - e^-x) / x: the mean of e^-t over [0, x].
inline double mean_transmittance(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// Samples t in [0, h] with density proportional to e^(-k t); uniform where that is constant to double
// precision.
inline double truncated_exponential(double u, double k, double h) {
  if (!(k * h > 1e-14)) return u * h;
  return std::min(h, -std::log1p(u * std::expm1(-k * h)) / k);
}
inline double truncated_exponential_pdf(double t, double k, double h) {
  return std::exp(-k * t) / (h * mean_transmittance(k * h));
}

// For a field of density rho on an interval that absorbs the share `absorbed` of the light: the integral of
// rho up to the sampled point. s: extinction per density.
inline double absorption_depth(double u, double s, double absorbed) { return -std::log1p(-u * absorbed) / s; }
// Its density, per unit length, at a point of density rho with transmittance `rest`.
inline double absorption_pdf(double s, double rho, double rest, double absorbed) {
  return s * rho * rest / absorbed;
}

}  // namespace ls::render
