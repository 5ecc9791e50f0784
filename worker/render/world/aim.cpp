#include "worker/render/world/aim.h"

#include <algorithm>
#include <utility>

#include "worker/render/world/pilot.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// The number of points at which light is sampled on each segment of a camera ray in a medium, if such points
// pay, that is, reduce the noise by more than they cost (docs/decisions/0027-light-along-camera-segments.md).
constexpr int kPointsThatPay = 2;
// Points pay if media scatter or absorb the camera rays that meet them with a mean probability below this
// (CameraCollisions::met). In denser media the free flights that end on the segment find the light often
// enough, unless connections to light vertices (light_vertices.h) have removed most of the other noise: with
// these, points pay at any probability.
constexpr float kThin = .35f;
// Second directions towards the sky (aim.h) pay if more than this share of the direct light comes from the
// constant environment.
constexpr double kSkyThatPays = .125;

int points_for(const IntegratorSettings& settings, const World& w) {
  if (settings.camera_points != 0) return std::max(0, settings.camera_points);
  // Points are for lights without a position (suns, the sky), because equi-angular sampling already finds the
  // other lights on every segment. Where media overlap, points are not supported.
  // Few paths of meters have segments that begin at a camera.
  if (!w.lights.any_without_place() || w.overlaps || w.meters.any()) return 0;
  const float met = camera_collisions(w).met;
  return met > 0 && (met < kThin || w.need.connected) ? kPointsThatPay : 0;
}

}  // namespace

void aim(const IntegratorSettings& settings, World& w) {
  w.lamps = {};
  w.lamp_flights = w.need.aimed = false;
  w.camera_points = 0;
  if (w.distant_mis || !w.need.media || !w.lights.can_sample() || !w.depth_allows(1)) return;
  const bool in_medium = std::any_of(w.media.begin(), w.media.end(), [](const Medium& m) {
    return m.equiangular_mode != EquiangularMode::none;
  });
  if (in_medium && !settings.phase_only)
    for (const V3& p : w.lights.points())
      if (w.lamps.count < kMaxLamps) w.lamps.position[w.lamps.count++] = p;
  const bool homogeneous = std::any_of(w.media.begin(), w.media.end(),
                                       [](const Medium& m) { return !m.grid && !is_black(m.sigma_t); });
  w.lamp_flights = settings.lamp_flights == 0 && w.lamps.count > 0 && homogeneous;
  w.camera_points = points_for(settings, w);
  w.need.aimed = w.lamps.count > 0 || w.camera_points > 0;
}

void learn_sky_samples(const IntegratorSettings& settings, World& w) {
  if (settings.sky_samples < 0 || w.need.media || w.need.connected || w.ray_flags ||
      is_black(w.lights.constant_environment()))
    return;
  if (!w.depth_allows(1)) return;
  // Paths of two segments are scattered at most once. Without the emitters that the camera sees directly,
  // which are hidden here, they find direct light only.
  const bool hide_emitters = std::exchange(w.hide_emitters, true);
  const bool hide_environment = std::exchange(w.hide_environment, true);
  const auto all = pilot_radiance(w, 2);
  const C3 sky = w.lights.exchange_constant_environment(C3(0));
  const auto others = pilot_radiance(w, 2);
  (void)w.lights.exchange_constant_environment(sky);
  w.hide_emitters = hide_emitters;
  w.hide_environment = hide_environment;
  w.sky_samples = all && *all - *others > kSkyThatPays * *all;
}

}  // namespace ls::render
