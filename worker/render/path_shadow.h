// Part of path.h, which includes it: what a shadow ray brings.
#pragma once

#include <algorithm>

#include "worker/render/built.h"
#include "worker/render/counters.h"
#include "worker/render/world.h"

namespace ls::render {

// Light that gets from the sampled light to `start`, through boundaries and media. p is `start`, moved off
// its surface after the light was sampled: the ray is aimed anew, so that it ends in front of the light and
// not on it.
template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::unoccluded(const V3& start, const V3& p, const LightSample& light,
                                    const Within& medium, RandomStream stream) {
  V3 d = light.direction;
  float left = light.distance;
  if (std::isfinite(left)) {
    const V3 f = light.target - p;
    left = std::sqrt(dot(f, f));
    if (!(left > 0)) return light.radiance;
    d = f / left;
  }
  LS_COUNT(shadow_rays);
  if (world_.accel.occluded(p, d, left)) return {0, 0, 0};
  bool walk = F.passing && world_.shadows_walk;
  if constexpr (F.media) walk = walk || medium.any();
  return walk ? through_boundaries(light.radiance, start, p, d, left, medium, stream) : light.radiance;
}

// What of `value` gets along the unoccluded ray from p: surfaces that let light pass, and media, take their
// share.
template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::through_boundaries(C3 value, const V3& start, const V3& p, const V3& d, float left,
                                            Within medium, RandomStream stream) {
  V3 from = start, o = p;
  for (int i = 0; i < kMaxShadowSegments; ++i) {
    SurfaceHit hit;
    LS_COUNT(boundary_rays);
    const auto primitive = world_.accel.nearest_boundary(o, d, left);
    const bool met = primitive && world_.geometry.complete(*primitive, o, d, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident) prefer_scatterer(hit, o, d, left);
    }
    if constexpr (F.media) {
      if (medium.any()) {
        const float t =
            met && hit.t <= left ? way_to(hit, from, o, d) : std::max(0.f, left + dot(o - from, d));
        value *= through_media(medium, from, d, t, stream);
        if (is_black(value)) return value;
      }
    }
    if (!met) return value;
    if (!may_go_on(depth_, passed_ + i + 1)) return {0, 0, 0};
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (kBuilt.veils && surface.veil) {
      value *= world_.bsdfs.veil(surface.bsdf, hit.uv_point(), hit.shading.to_local(-d)).transmission;
      if (is_black(value)) return value;
    }
    if constexpr (F.media) medium = beyond(hit, surface, d, d, medium);
    if constexpr (F.overlaps) {
      if (medium.overflowed()) {
        outcome_.reject(HealthCause::nested_media);
        return {0, 0, 0};
      }
    }
    const V3 next = offset_point(hit, d);
    if (std::isfinite(left)) left -= dot(next - o, d);
    from = hit.p;
    o = next;
    if (!(left > 0)) return value;
  }
  outcome_.reject(HealthCause::too_many_surfaces);
  return {0, 0, 0};
}

template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::through_media(const Within& media, const V3& from, const V3& d, float t,
                                       RandomStream& stream) const {
  if constexpr (F.overlaps) {
    if (media.several()) {
      C3 value(1);
      for (const std::uint32_t m : media.all())
        value *= transmittance<F>(world_.media[m], from, d, 0, t, RandomStream(stream.next()));
      return value;
    }
  }
  return transmittance<F>(world_.media[media.one()], from, d, 0, t, RandomStream(stream.next()));
}

}  // namespace ls::render
