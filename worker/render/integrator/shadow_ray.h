// Part of path_tracer.h, which includes it: computes how much light a shadow ray carries.
#pragma once

#include <algorithm>

#include "worker/render/base/features.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Returns the radiance that reaches `start` from the sampled light, after attenuation by media and by
// surfaces that light passes straight through. p is `start` moved off its surface. The light was sampled for
// `start`, so for a light at a finite distance the ray gets a new direction and length: from p to
// light.target, a point just in front of the light, so that the light itself does not block the ray.
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
  if constexpr (F.media) {
    const Medium* const clear = std::isfinite(left) ? nullptr : clear_medium(medium, start);
    if (const auto t = clear ? clear->clear->way_out(start, d) : std::nullopt)
      return light.radiance * through_media(medium, start, d, *t, stream);
  }
  LS_COUNT(shadow_rays);
  if (occluded(p, d, left)) return {0, 0, 0};
  bool walk = F.passing && world_.shadows_walk;
  if constexpr (F.media) walk = walk || medium.any();
  return walk ? through_boundaries(light.radiance, start, p, d, left, medium, stream) : light.radiance;
}

// Returns `value` times the transmittance of everything along the ray from p in the direction d, of length
// `left`: of the media, and of the surfaces that light passes straight through (null transmission). No
// surface that is opaque to all lights may block the ray. `medium` contains the media at the start of the
// ray. `start` is p before it was moved off its surface; lengths in media are measured from there.
template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::through_boundaries(C3 value, const V3& start, const V3& p, const V3& d, float left,
                                            Within medium, RandomStream stream) {
  OffsetRay ray{start, p, d};
  int unmet = 0;  // number of surfaces that are hidden from shadow rays
  for (int i = 0; i < kMaxShadowSegments; ++i) {
    SurfaceHit hit;
    LS_COUNT(boundary_rays);
    const auto primitive = nearest_boundary(ray.origin, d, left);
    const bool met = primitive && complete(*primitive, ray.origin, d, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident) prefer_scatterer(hit, ray.origin, d, left, RayKind::shadow);
    }
    if constexpr (F.media) {
      if (medium.any()) {
        const float t = met && hit.t <= left ? ray.length_to(hit) : std::max(0.f, left + ray.lead());
        const C3 through = through_media(medium, ray.start, d, t, stream);
        value *= through;
        if constexpr (F.reuse) sharing_.flight *= through;
        if (is_black(value)) return value;
      }
    }
    if constexpr (F.connected && F.media) {
      if (connections_.learner && !std::isfinite(left)) {
        const Within behind =
            met ? beyond(hit, world_.geometry.surfaces[hit.surface], -d, -d, medium) : Within{};
        if (behind.one() != medium.one()) connections_.learner->media_differ = true;
      }
    }
    if (!met) return value;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    bool hidden = false;
    if constexpr (F.visibility) {
      if (surface.hidden.any()) [[unlikely]] {
        hidden = is_hidden(hit.surface, RayKind::shadow);
        // A surface that shades this light, but not all others
        const bool opaque = !surface.null && !surface.null_transmission;
        if (!hidden && opaque && surface.hidden.has(RayKind::some_shadow)) return {0, 0, 0};
      }
    }
    if (hidden) ++unmet;
    if (!may_go_on(depth_, passed_ + i + 1 - unmet)) return {0, 0, 0};
    if (surface.null_transmission && !hidden) {
      const NullTransmission null_transmission =
          world_.bsdfs.null_transmission(surface.bsdf, hit.uv_point(), hit.shading.to_local(-d));
      value *= null_transmission.transmission;
      if constexpr (F.reuse) sharing_.flight *= null_transmission.probability;
      if (is_black(value)) return value;
    }
    if constexpr (F.connected) ++boundaries_;
    if constexpr (F.reuse) ++sharing_.crossed;
    if constexpr (F.media) medium = beyond(hit, surface, d, d, medium);
    if constexpr (F.overlaps) {
      if (medium.overflowed()) {
        outcome_.reject(HealthCause::nested_media);
        return {0, 0, 0};
      }
    }
    const V3 last = ray.origin;
    ray.leave(hit, d);
    if (std::isfinite(left)) left -= dot(ray.origin - last, d);
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
