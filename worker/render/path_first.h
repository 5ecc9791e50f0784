// Part of path.h, which includes it: what a camera ray sees, for AOVs.
#pragma once

#include "worker/render/world.h"

namespace ls::render {

struct FirstSurface {
  SurfaceHit hit;
  float not_passed = 1;  // 1 over the share of light that the surface does not let pass straight on
};

// Index-matched surfaces are passed, and of those that let a share of the light pass that share: by the very
// numbers with which the path itself decides, as long as it meets what this ray meets.
template <Features F, template <Features> class Light>
std::optional<FirstSurface> PathTracer<F, Light>::first_surface(const CameraRay& ray) {
  o_ = ray.o;
  d_ = ray.d;
  float t_max = ray.t_max;
  FirstSurface first;
  SurfaceHit& hit = first.hit;
  for (segment_ = 0; segment_ < kMaxSegments; ++segment_, t_max = kInfinity) {
    const auto primitive = world_.accel.nearest(o_, d_, t_max);
    if (!primitive || !world_.geometry.complete(*primitive, o_, d_, hit)) return std::nullopt;
    if (world_.coincident) prefer_scatterer(hit, o_, d_, kInfinity);
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    beta_ = C3(1);
    if (!surface.null && !(surface.veil && passes_veil(hit))) {
      first.not_passed = beta_.x;
      return first;
    }
    o_ = offset_point(hit, d_);
  }
  return std::nullopt;
}

}  // namespace ls::render
