// Where on a stretch of a ray the light that a medium gives off is asked for (glow.cpp).
#pragma once

#include <algorithm>
#include <cmath>

namespace ls::render {

// (1 - e^-x) / x, the mean of e^-t up to x.
inline double mean_transmittance(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// t in [0, h] as if the extinction were k all along; uniform where that is flat to double precision.
inline double truncated_exponential(double u, double k, double h) {
  if (!(k * h > 1e-14)) return u * h;
  return std::min(h, -std::log1p(u * std::expm1(-k * h)) / k);
}
inline double truncated_exponential_pdf(double t, double k, double h) {
  return std::exp(-k * t) / (h * mean_transmittance(k * h));
}

// In a field of density rho, where light is absorbed of which the stretch takes the share `absorbed`: the
// point whose integral of rho from the beginning on is this. s: extinction per density.
inline double absorption_depth(double u, double s, double absorbed) { return -std::log1p(-u * absorbed) / s; }
// Its density, per length, at a point of density rho with `rest` of the light left.
inline double absorption_pdf(double s, double rho, double rest, double absorbed) {
  return s * rho * rest / absorbed;
}

}  // namespace ls::render
