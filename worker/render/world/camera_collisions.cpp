#include "worker/render/world/camera_collisions.h"

#include <cmath>

#include "worker/render/media/optical_depth.h"

namespace ls::render {
namespace {

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

}  // namespace

CameraCollisions camera_collisions(const World& w) {
  constexpr int kLattice = 16;
  constexpr float kNothing = 1e-3f;
  double all = 0, met = 0;
  int rays = 0;
  for (int j = 0; j < kLattice; ++j)
    for (int i = 0; i < kLattice; ++i) {
      const double x = (i + .5) / kLattice * w.frame.width, y = (j + .5) / kLattice * w.frame.height;
      const float p = met_by(w, w.camera.ray(x, y, {.5f, .5f}));
      all += p;
      if (!(p > kNothing)) continue;
      met += p;
      ++rays;
    }
  return {static_cast<float>(all / (kLattice * kLattice)), rays > 0 ? static_cast<float>(met / rays) : 0};
}

}  // namespace ls::render
