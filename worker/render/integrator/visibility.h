// Part of path_tracer.h, which includes it: light that comes straight from lights to a vertex where some
// shapes or lights are hidden from some kinds of rays (Features::visibility, RayKind).
//
// A ray passes a surface that is hidden from its kind as if the surface were not there; media behind it stay.
// So a direction may be free for shadow rays and blocked for scattered rays, or the other way round, and
// next-event estimation and scattered rays that hit a light would estimate different integrals. Where that is
// possible (World::direct_by_shadows, or a light that is linked to blockers), the integral is the one that
// shadow rays see. Scattered rays then bring no light straight from a light; instead add_direct() walks along
// each of their directions as a shadow ray does, and adds what lights there give, weighted against next-event
// estimation as usual. Excepted are mirrors and, for lights without blockers, those directions of glossy
// surfaces that have a high density (kLikeMirror): there the scattered ray's hit alone counts, and next-event
// estimation adds nothing. Otherwise a glossy floor would show the shadow of a shape that is missing in its
// reflections. The light of lights with blockers passes the same shapes everywhere but in mirrors.
#pragma once

#include <cmath>
#include <optional>

#include "worker/render/world/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::turn_to([[maybe_unused]] const LightChoice& choice,
                                   [[maybe_unused]] const SurfaceHit& hit) {
  if constexpr (F.visibility) {
    if (world_.ray_flags)
      return turn_to(world_.lights.reach(choice.light), RayKind::surface, world_.surface_links[hit.surface]);
  }
  return true;
}

template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::turn_to([[maybe_unused]] const LightChoice& choice,
                                   [[maybe_unused]] const Medium& medium) {
  if constexpr (F.visibility) {
    if (world_.ray_flags)
      return turn_to(world_.lights.reach(choice.light), RayKind::medium,
                     world_.medium_links[index_of(medium)]);
  }
  return true;
}

template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::turn_to(const LightReach& reach, RayKind kind, scene::LinkMask links) {
  links_.blockers = reach.blockers;
  return reach.lights(kind, links);
}

template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::is_hidden(std::uint32_t surface, RayKind kind) const {
  const RayKinds hidden = world_.geometry.surfaces[surface].hidden;
  if (hidden.has(kind)) return true;
  if constexpr (F.visibility)
    return kind == RayKind::shadow && hidden.has(RayKind::some_shadow) &&
           !scene::linked(links_.blockers, world_.surface_links[surface]);
  return false;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_direct() {
  direct_due_ = false;
  for (const scene::LinkIndex list : world_.shadow_lists)
    if (!like_mirror_ || list != scene::kEverything) add_direct_past(list);
}

// Adds the light of the lights about which shadow rays decide and that are linked to this list of blockers.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_direct_past(scene::LinkIndex blockers) {
  links_.blockers = blockers;
  const RayKind kind = ray_kind();
  OffsetRay ray = ray_;
  Within medium = medium_;
  C3 beta = beta_;
  int passed = passed_;
  RandomStream stream = stream_.stream(segment_, Purpose::track_direct);
  const auto add_light_of = [&](const SurfaceHit& hit) {
    if (world_.geometry.surfaces[hit.surface].light == kNone) return;
    const LightReach& reach = reach_of(hit);
    if (reach.blockers == blockers && reach.lights(kind, links_.receiver)) add_emission_times(beta, hit);
  };
  for (int i = 0; i < kMaxShadowSegments; ++i) {
    SurfaceHit hit;
    const auto primitive = nearest(ray.origin, ray.d, kInfinity);
    const bool met = primitive && complete(*primitive, ray.origin, ray.d, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident) prefer_scatterer(hit, ray.origin, ray.d, kInfinity, RayKind::shadow);
    }
    if constexpr (F.media) {
      if (medium.any()) {
        beta *= through_media(medium, ray.start, ray.d, met ? ray.length_to(hit) : kInfinity, stream);
        if (is_black(beta)) return;
      }
    }
    if (!met) {
      if (is_finite(ray.d)) add_environment_times(beta, true);
      return;
    }
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if constexpr (F.overlaps) {
      if (world_.lights_on_others && surface.coincident_reach > 0) {
        const CoincidentHits others = others_at(hit, ray.d, ray.d);
        for (int k = 0; k < others.count; ++k) {
          SurfaceHit other;
          const PrimitiveId id = others.ids[static_cast<std::size_t>(k)];
          if (!complete(id, ray.origin, ray.d, other)) continue;
          if (world_.geometry.surfaces[other.surface].null || is_hidden(other.surface, RayKind::shadow))
            add_light_of(other);
        }
      }
    }
    add_light_of(hit);
    if (!is_hidden(hit.surface, RayKind::shadow)) {
      if (!surface.null && !surface.null_transmission) return;
      if (surface.null_transmission) {
        beta *= world_.bsdfs.null_transmission(surface.bsdf, hit.uv_point(), hit.shading.to_local(-ray.d))
                    .transmission;
        if (is_black(beta)) return;
      }
      if (!may_go_on(depth_, ++passed)) return;
    }
    const V3 from = ray.d;
    if constexpr (F.media) medium = beyond(hit, surface, from, from, medium);
    if constexpr (F.overlaps) {
      if (medium.overflowed()) return outcome_.reject(HealthCause::nested_media);
    }
    ray.leave(hit, from);
  }
  outcome_.reject(HealthCause::too_many_surfaces);
}

// Adds the light of the environment for the path's current ray, times beta: of the parts that the vertex
// receives. If `by_shadows`, these are the parts that add_direct_past() finds, else those that the scattered
// ray finds.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_environment_times(const C3& beta, bool by_shadows) {
  const float pdf = last_.pdf / last_.in_medium.found_as_light();
  const auto pdf_of = [&](const LightReach& reach) -> std::optional<float> {
    if (!reach.lights(ray_kind(), links_.receiver)) return std::nullopt;
    if (found_by_shadows(reach) != by_shadows || (by_shadows && reach.blockers != links_.blockers))
      return std::nullopt;
    return hits_count_fully(reach) ? kInfinity : pdf;
  };
  C3 light(0);
  world_.lights.environment_by_reach(last_.p, ray_.d, pdf_of, last_.place,
                                     [&](LightGroup group, const C3& part) {
                                       light += part;
                                       if constexpr (F.split) add_to_group(group, beta * part);
                                     });
  add(beta * light, kNoLightGroup);
}

}  // namespace ls::render
