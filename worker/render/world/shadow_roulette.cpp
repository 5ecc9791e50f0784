#include "worker/render/world/shadow_roulette.h"

#include <cmath>

#include "worker/render/world/pilot.h"

namespace ls::render {
namespace {

constexpr int kLongestPath = 64;  // paths in a white and dense medium have thousands of segments
// Shadow rays that could bring less than this share of the mean radiance are traced at random.
constexpr float kFaint = 1;

}  // namespace

void learn_shadow_roulette(const IntegratorSettings& settings, World& w) {
  if (settings.shadow_roulette < 0 || !w.need.grids || w.need.connected || !w.lights.can_sample()) return;
  if (!w.depth_allows(1)) return;
  const auto mean = pilot_radiance(w, kLongestPath);
  if (mean && *mean > 0 && std::isfinite(*mean)) w.faint_shadow = kFaint * static_cast<float>(*mean);
}

}  // namespace ls::render
