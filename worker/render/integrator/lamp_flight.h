// Free flight through a homogeneous medium with lamps (lights without extent). A share of the flights ends at
// a distance that is sampled equi-angularly about a lamp. Multiply scattered light grows as 1 / distance near
// a lamp, and plain exponential flights rarely end that near.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/integrator/equiangular.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/medium.h"

namespace ls::render {

// The share of flights whose distance is sampled about a lamp.
inline constexpr float kLampFlightShare = .1f;

// Samples a flight from o along d that ends at t_max at the latest; t_max must be finite. `hero` is the
// colour channel that decides distances (medium.h). There must be at least one lamp. The random number u(1)
// of `numbers` decides whether the distance is exponential, given by bits[0], or sampled about a lamp, given
// by u(2). The weight and the densities of the result mean the same as those of free_flight(). The density of
// a distance is that of the mixture, so the weights follow the balance heuristic.
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
  // For each channel: the transmittance, and the density of this flight if the channel were the hero
  C3 through, pdf;
  for (int c = 0; c < 3; ++c) {
    through[c] = std::exp(-medium.sigma_t[c] * length);
    const float alone = (1 - kLampFlightShare) * through[c];
    pdf[c] = f.scattered ? medium.sigma_t[c] * alone + near : alone;
  }
  const float own = pdf[hero];
  // The densities underflow only where the transmittance is 0, too
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
