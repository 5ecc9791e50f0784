// Samples the points on an interval of a ray at which medium emission is evaluated (emission.cpp).
#pragma once

#include <algorithm>
#include <cmath>

namespace ls::render {

// The mean of e^-t over [0, x]: (1 - e^-x) / x.
inline double mean_transmittance(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// Samples t in [0, h] with density proportional to e^(-k t) from the random number u. If that density is
// constant to double precision, t is uniform.
inline double truncated_exponential(double u, double k, double h) {
  if (!(k * h > 1e-14)) return u * h;
  return std::min(h, -std::log1p(u * std::expm1(-k * h)) / k);
}

// Samples a point on an interval with a field of density rho. The interval absorbs the share `absorbed` of
// the light; s is the extinction per density and u a random number. Returns the integral of rho up to the
// sampled point.
inline double absorption_depth(double u, double s, double absorbed) { return -std::log1p(-u * absorbed) / s; }
// Returns the density, per unit length, with which absorption_depth() samples a point where the field has the
// density rho. `rest` is the transmittance up to that point.
inline double absorption_pdf(double s, double rho, double rest, double absorbed) {
  return s * rho * rest / absorbed;
}

}  // namespace ls::render
