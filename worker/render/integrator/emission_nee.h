// Part of path_tracer.h, which includes it: next-event estimation towards emissive grids (emissive_grids.h).
// At each vertex a direction towards them is sampled, and a point on its ray whose emission is an estimate of
// the light from there. A scattered ray in that direction meets the same light (add_medium_emission()); the
// two are combined by the balance heuristic over directions.
#pragma once

#include "worker/render/integrator/mis.h"
#include "worker/render/world/roulette.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Returns the weight of the light that the medium gives off along the path's current ray.
template <Features F, template <Features> class Light>
float PathTracer<F, Light>::emissive_weight(const Medium& medium) {
  if (last_.delta || !world_.emissive.has(static_cast<std::uint32_t>(index_of(medium)))) return 1;
  if (emissive_.pdf < 0) emissive_.pdf = world_.emissive.pdf(last_.p, ray_.d);
  return balance_weight(last_.pdf, emissive_.pdf);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::look_for_emission_on(const SurfaceHit& hit, const V3& wo) {
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  if (!world_.emissive.any() || !surface.smooth) return;
  RandomStream stream = stream_.stream(depth_, Purpose::track_emissive);
  const auto found = world_.emissive.sample(hit.p, stream_.group(depth_, Purpose::emissive), stream);
  if (!found) return;
  const V3 wi = hit.shading.to_local(found->w);
  if ((wi.z > 0) != (dot(found->w, hit.ng) > 0)) return;  // as for light_surface_by()
  const BsdfEval f = world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wo, wi);
  if (is_black(f.f_cos)) return;
  float sampled = f.pdf;
  if constexpr (F.aimed) sampled = near_lamps_.pdf(f.pdf, found->w);
  OffsetRay ray;
  ray.leave(hit, found->w);
  add_emission_at(*found, beta_ * f.f_cos * (1 / (found->pdf + sampled)), ray,
                  beyond(hit, surface, found->w, ray_.d, medium_), stream);
}

// d is the direction of travel before the scattering.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::look_for_emission_in(const Medium& medium, const V3& d) {
  if (!world_.emissive.any()) return;
  RandomStream stream = stream_.stream(depth_, Purpose::track_emissive);
  const auto found = world_.emissive.sample(last_.p, stream_.group(depth_, Purpose::emissive), stream);
  if (!found) return;
  const PhaseValue<F> phase = medium.phase_value<F>(last_.p, d, found->w);
  const float sampled = direction_pdf(last_.p, phase.pdf, found->w);
  OffsetRay ray = ray_;
  ray.d = found->w;
  add_emission_at(*found, beta_ * phase.value * (1 / (found->pdf + sampled)), ray, medium_, stream);
}

// Adds the light of the point, times `weight`, if it reaches the start of the ray, which leads to the point.
// `medium` contains the media at its start.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission_at(const EmissiveGrids::Point& point, const C3& weight, OffsetRay ray,
                                           Within medium, RandomStream& stream) {
  C3 light = weight * point.emission * (1 / point.pdf_of_distance);
  if (is_black(light)) return;
  if (world_.faint_shadow > 0) {
    float most = mean(light);
    if constexpr (F.chromatic) most /= mean(density_);
    const float traced = shadow_ray_probability(most, world_.faint_shadow);
    if (!(stream.uniform() < traced)) return;
    light /= traced;
  }
  const RayKind kind = left_medium_ ? RayKind::medium : RayKind::surface;
  float left = point.distance;
  int passed = passed_;
  for (int i = 0; i < kMaxShadowSegments; ++i) {
    SurfaceHit hit;
    LS_COUNT(shadow_rays);
    const auto primitive = nearest(ray.origin, ray.d, left);
    const bool met = primitive && complete(*primitive, ray.origin, ray.d, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident) prefer_scatterer(hit, ray.origin, ray.d, left, kind);
    }
    const float length = met ? ray.length_to(hit) : left;
    const bool there = !met || length >= left;
    if (medium.any()) {
      light *= through_media(medium, ray.start, ray.d, std::min(length, left), stream);
      if (is_black(light)) return;
    }
    if (there) {
      const int times = medium.count(point.medium);
      if (times > 0) add(light * static_cast<float>(times), world_.media[point.medium].light_group);
      return;
    }
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    bool hidden = false;
    if constexpr (F.visibility) hidden = is_hidden(hit.surface, kind);
    if (!hidden) {
      if (!surface.null && !surface.null_transmission) return;
      if (surface.null_transmission) {
        light *= world_.bsdfs.null_transmission(surface.bsdf, hit.uv_point(), hit.shading.to_local(-ray.d))
                     .transmission;
        if (is_black(light)) return;
      }
      if (!may_go_on(depth_, ++passed)) return;
    }
    medium = beyond(hit, surface, ray.d, ray.d, medium);
    if constexpr (F.overlaps) {
      if (medium.overflowed()) return outcome_.reject(HealthCause::nested_media);
    }
    ray.leave(hit, ray.d);
    left -= length;
  }
  outcome_.reject(HealthCause::too_many_surfaces);
}

}  // namespace ls::render
