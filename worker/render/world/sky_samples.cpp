#include "worker/render/world/sky_samples.h"

#include <utility>

#include "worker/render/world/pilot.h"

namespace ls::render {
namespace {

// Second directions pay if more than this share of the direct light comes from the constant environment.
constexpr double kSkyThatPays = .125;

}  // namespace

void learn_sky_samples(const IntegratorSettings& settings, World& w) {
  if (settings.sky_samples < 0 || w.need.media || w.need.connected ||
      is_black(w.lights.constant_environment()))
    return;
  if (!w.depth_allows(1)) return;
  // Paths of two segments are scattered at most once, so they find direct light only.
  const bool hide_emitters = std::exchange(w.hide_emitters, true);
  const auto all = pilot_radiance(w, 2);
  const C3 sky = w.lights.exchange_constant_environment(C3(0));
  const auto others = pilot_radiance(w, 2);
  (void)w.lights.exchange_constant_environment(sky);
  w.hide_emitters = hide_emitters;
  w.sky_samples = all && *all - *others > kSkyThatPays * *all;
}

}  // namespace ls::render
