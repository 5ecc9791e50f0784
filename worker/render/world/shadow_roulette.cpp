#include "worker/render/world/shadow_roulette.h"

namespace ls::render {
namespace {

// Shadow rays that could add less than this share of the mean radiance are subject to Russian roulette.
constexpr float kFaintShadowRay = 1;

}  // namespace

void learn_shadow_roulette(const IntegratorSettings& settings, float mean_radiance, World& w) {
  if (settings.shadow_roulette < 0 || !w.lights.can_sample()) return;
  w.faint_shadow = kFaintShadowRay * mean_radiance;
}

}  // namespace ls::render
