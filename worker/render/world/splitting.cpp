#include "worker/render/world/splitting.h"

#include "worker/render/world/camera_collisions.h"

namespace ls::render {
namespace {

// Paths split if media of any kind scatter or absorb less than this share of the camera rays. If nearly all
// pixels show a cloud, splitting is no better than more samples.
constexpr float kSplitsPay = .75f;

}  // namespace

void learn_splitting(const IntegratorSettings& settings, float mean_radiance, World& w) {
  // Single scattering is found at the vertex that would be split, so splitting needs a longer path
  if (settings.path_splitting < 0 || !w.depth_allows(2)) return;
  w.mean_radiance = mean_radiance;
  w.paths_split = camera_collisions(w).all < kSplitsPay;
}

}  // namespace ls::render
