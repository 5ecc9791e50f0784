// Medium emission along a ray: the integral of transmittance times emission over the whole segment, instead
// of an estimate at the collisions of free flights. So it also works in media without extinction, in which
// there are no collisions, and deep inside opaque media.
//
// In a homogeneous medium and in fog that falls with height it has a closed form. In a grid the ray is
// divided into intervals, at most one voxel long where the fields vary. The optical depth of an interval is
// exact (Grid::pass). Each channel's emission is estimated from one point of the interval, or two if the
// interval is optically thick and not uniform; without extinction it is integrated exactly. Every term is
// unbiased, and hence also the sum.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/media/medium.h"

namespace ls::render {

// Returns the attenuated emission over the length t_max of a homogeneous medium. t_max may be infinite; the
// result is infinite if the integral diverges.
C3 emission_of_length(const Medium& m, float t_max);

// Returns the attenuated emission along o + t d, from t = 0 to t_max, of a medium whose density falls with
// height. Such a medium emits in proportion to its density: as a homogeneous one over the length that holds
// as much of it.
inline C3 emission_of_height(const Medium& m, const V3& o, const V3& d, float t_max) {
  return emission_of_length(m, static_cast<float>(HeightRay(*m.height, o, d).depth(t_max)));
}

// Returns an unbiased estimate of the attenuated emission of a grid along o + t d, from t = 0 to t_max. d has
// unit length.
C3 emission_of_grid(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream);

// Returns the emission of a grid at the world point p [radiance per world unit].
C3 emission_at(const Medium& m, const V3& p);
// True if a medium with an emission grid may give off light where that grid is at most `value`.
bool may_emit(const Medium& m, float value);

// The functions below are for the points on an interval of a ray at which emission_of_grid() evaluates the
// emission.

// The mean of e^-t over [0, x]: (1 - e^-x) / x.
inline double mean_transmittance(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// Samples t in [0, h] with density proportional to e^(-k t) from the random number u. If that density is
// constant to double precision, t is uniform.
inline double truncated_exponential(double u, double k, double h) {
  if (!(k * h > 1e-14)) return u * h;
  return std::min(h, -std::log1p(u * std::expm1(-k * h)) / k);
}

// Samples a point on an interval with a field of density rho. The interval absorbs the share `absorbed` of
// the light; s is the extinction per unit of density and u a random number. Returns the integral of rho up to
// the sampled point.
inline double absorption_depth(double u, double s, double absorbed) { return -std::log1p(-u * absorbed) / s; }
// Returns the density, per unit length, with which absorption_depth() samples a point where the field has the
// density rho. `rest` is the transmittance up to that point.
inline double absorption_pdf(double s, double rho, double rest, double absorbed) {
  return s * rho * rest / absorbed;
}

}  // namespace ls::render
