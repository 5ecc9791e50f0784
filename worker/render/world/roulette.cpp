#include "worker/render/world/roulette.h"

#include "worker/render/world/pilot.h"

namespace ls::render {
namespace {

// Paths split if media of any kind scatter or absorb less than this share of the camera rays. In images where
// nearly all pixels show a cloud, splitting is no better than more samples per pixel.
constexpr float kSplitsPay = .75f;

}  // namespace

void learn_splitting(const IntegratorSettings& settings, float mean_radiance, World& w) {
  // The first vertex estimates the light that is scattered once, and the path splits after that. So splitting
  // is of use only if paths may be scattered a second time.
  if (settings.path_splitting < 0 || !w.depth_allows(2)) return;
  w.mean_radiance = mean_radiance;
  w.paths_split = camera_collisions(w).all < kSplitsPay;
}

void learn_shadow_roulette(const IntegratorSettings& settings, float mean_radiance, World& w) {
  if (settings.shadow_roulette < 0 || !(w.lights.can_sample() || w.emissive.any())) return;
  w.faint_shadow = kFaintShadowRay * mean_radiance;
}

}  // namespace ls::render
