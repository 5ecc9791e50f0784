// Free flights through homogeneous media with lamps (lights without extent): a share of them ends where
// equi-angular sampling about a lamp says. Light that was scattered before it arrives near a lamp is as
// bright as 1 / distance there, and flights of the medium alone rarely end so near.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/integrator/equiangular.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/medium.h"

namespace ls::render {

// How many flights end near a lamp.
inline constexpr float kLampFlightShare = .1f;

// The flight from o along d, of length t_max at most (finite), by the numbers bits[0] (its depth), u(1)
// (which distribution) and u(2) (the place near the lamp). There must be a lamp. Weights and densities are as
// those of free_flight(); the density of a distance is that of the mixture, the balance heuristic.
inline Flight fly_past_lamps(const Medium& medium, int hero, const Group& numbers, const V3& o, const V3& d,
                             float t_max, const Lamps& lamps) {
  const auto about = [&](std::size_t i) { return EquiAngular(o, d, t_max, lamps.position[i]); };
  Flight f;
  if (const float choice = numbers.u(1); choice < kLampFlightShare) {
    const auto lamp = static_cast<std::size_t>(choice / kLampFlightShare * static_cast<float>(lamps.count));
    f.t = about(std::min(lamp, lamps.count - 1)).sample(numbers.u(2)).t;
  } else {
    const float s = medium.sigma_t[hero];
    f.t = s > 0 ? exponential(numbers.bits[0]) / s : kInfinity;
  }
  f.scattered = f.t < t_max;
  const float length = f.scattered ? f.t : t_max;
  float near = 0;
  if (f.scattered) {
    for (std::size_t i = 0; i < lamps.count; ++i) near += about(i).pdf(length);
    near *= kLampFlightShare / static_cast<float>(lamps.count);
  }
  // By channel: the transmittance, and the density of this flight with the channel as the hero
  C3 through, pdf;
  for (int c = 0; c < 3; ++c) {
    through[c] = std::exp(-medium.sigma_t[c] * length);
    const float alone = (1 - kLampFlightShare) * through[c];
    pdf[c] = f.scattered ? medium.sigma_t[c] * alone + near : alone;
  }
  const float own = pdf[hero];
  // Both densities underflow only where no light passes either
  if (!(own > 0)) {
    f.weight = C3(0);
    return f;
  }
  for (int c = 0; c < 3; ++c) {
    f.weight[c] = (f.scattered ? medium.sigma_s[c] * through[c] : through[c]) / own;
    f.density[c] = pdf[c] / own;
  }
  return f;
}

}  // namespace ls::render
