#include "worker/render/world/aim.h"

#include <algorithm>
#include <cmath>

#include "worker/render/media/optical_depth.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// The number of points on a camera segment if points pay
// (docs/decisions/0027-light-along-camera-segments.md).
constexpr int kPointsThatPay = 2;
// Points pay if the mean probability that a camera ray collides with a medium is below this. In denser media
// the flights that end on the segment find the light often enough, unless connections to light vertices
// (light_vertices.h) have removed most of the other noise.
constexpr float kThin = .35f;

// Returns the probability that media scatter or absorb a camera ray before it hits a surface.
float met_by(const World& w, const CameraRay& ray) {
  V3 start = ray.o, origin = ray.o;
  std::uint32_t medium = w.camera_medium;
  float passes = 1, left = ray.t_max;
  constexpr int kMaxBoundaries = 16;
  for (int i = 0; i < kMaxBoundaries; ++i) {
    SurfaceHit hit;
    const auto primitive = w.accel.nearest(origin, ray.d, left);
    const bool met = primitive && w.geometry.complete(*primitive, origin, ray.d, hit);
    if (medium != kNone) {
      const Medium& m = w.media[medium];
      const OpticalDepth depths(m, start, ray.d, met ? dot(hit.p - start, ray.d) : left);
      // A ray without end through a medium without end has an infinite optical depth, or 0 times infinity
      const float depth = mean_component(m.sigma_t) * depths.total();
      passes *= depth > 0 ? std::exp(-depth) : 1.f;
    }
    const SurfaceInfo* surface = met ? &w.geometry.surfaces[hit.surface] : nullptr;
    if (!met || !surface->null) break;
    if (surface->transition) medium = dot(ray.d, hit.ng) > 0 ? surface->exterior : surface->interior;
    start = hit.p;
    origin = offset_point(hit, ray.d);
    left = kInfinity;
  }
  return 1 - passes;
}

// Returns the mean of met_by() over a lattice of camera rays. Rays with a probability near 0 are left out.
float mean_met(const World& w, FrameSize frame) {
  constexpr int kLattice = 16;
  constexpr float kNothing = 1e-3f;
  float sum = 0;
  int rays = 0;
  for (int j = 0; j < kLattice; ++j)
    for (int i = 0; i < kLattice; ++i) {
      const double x = (i + .5) / kLattice * frame.width, y = (j + .5) / kLattice * frame.height;
      const float p = met_by(w, w.camera.ray(x, y, {.5f, .5f}));
      if (!(p > kNothing)) continue;
      sum += p;
      ++rays;
    }
  return rays > 0 ? sum / static_cast<float>(rays) : 0;
}

int points_for(const IntegratorSettings& settings, FrameSize frame, const World& w) {
  if (settings.camera_points != 0) return std::max(0, settings.camera_points);
  // Lights with a position are already found by equi-angular sampling on every segment; and where media
  // overlap, points on segments are not supported
  if (!w.lights.any_without_place() || w.overlaps) return 0;
  const float met = mean_met(w, frame);
  return met > 0 && (met < kThin || w.need.connected) ? kPointsThatPay : 0;
}

}  // namespace

void aim(const IntegratorSettings& settings, FrameSize frame, World& w) {
  if (w.distant_mis || !w.need.media || !w.lights.can_sample() || !w.depth_allows(1)) return;
  const bool in_medium = std::any_of(w.media.begin(), w.media.end(), [](const Medium& m) {
    return m.equiangular_mode != EquiangularMode::none;
  });
  w.lamps = {};
  if (in_medium && !settings.phase_only)
    for (const V3& p : w.lights.points())
      if (w.lamps.count < kMaxLamps) w.lamps.position[w.lamps.count++] = p;
  const bool homogeneous = std::any_of(w.media.begin(), w.media.end(),
                                       [](const Medium& m) { return !m.grid && !is_black(m.sigma_t); });
  w.lamp_flights = settings.lamp_flights == 0 && w.lamps.count > 0 && homogeneous;
  w.camera_points = points_for(settings, frame, w);
  w.need.aimed = w.lamps.count > 0 || w.camera_points > 0;
}

}  // namespace ls::render
