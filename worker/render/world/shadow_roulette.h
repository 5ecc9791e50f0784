// Russian roulette of shadow rays (Arvo and Kirk 1990, "Particle transport and image synthesis"). In clouds
// shadow rays through grids cost a large part of the time, because each tracks the medium all the way to the
// light. Many of them could add little light, because the phase function has a small value in that direction
// or because the path has a small throughput. So a shadow ray whose light would be faint even without
// attenuation is traced only with a probability in proportion to that light.
#pragma once

#include <algorithm>

#include "common/scene/scene.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The smallest probability with which a shadow ray is traced. It limits the noise: in pixels of any
// brightness, roulette adds to the variance at most 1 / kLeastTraced - 1 times the second moment of the light
// that the shadow rays find.
inline constexpr float kLeastTraced = .25f;
// Shadow rays that could add less than this share of the mean radiance are subject to Russian roulette.
inline constexpr float kFaintShadowRay = 1;

// The probability with which a shadow ray is traced. `light` is the mean over the channels of the light that
// the ray would add to the sample without attenuation.
inline float shadow_ray_probability(float light, float faint_shadow) {
  return light < faint_shadow ? std::max(light / faint_shadow, kLeastTraced) : 1.f;
}

// Sets `faint_shadow` of a world with grids and without light vertices, which is otherwise complete.
// `mean_radiance` is that of the image.
inline void learn_shadow_roulette(const IntegratorSettings& settings, float mean_radiance, World& w) {
  if (settings.shadow_roulette < 0 || !w.lights.can_sample()) return;
  w.faint_shadow = kFaintShadowRay * mean_radiance;
}

}  // namespace ls::render
