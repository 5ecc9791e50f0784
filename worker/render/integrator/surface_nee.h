// Part of path_tracer.h, which includes it: next-event estimation at surfaces.
#pragma once

#include "worker/render/world/world.h"

namespace ls::render {

// Adds the light that next-event estimation finds at a surface. wo is the direction back along the path, in
// the shading frame of `hit`.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_surface(const SurfaceHit& hit, const V3& wo) {
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  if (!world_.lights.can_sample() || !surface.smooth) return;
  const Group g = stream_.group(depth_, Purpose::light);
  if constexpr (F.connected) {
    learn_lights({hit.p, hit.shading.n},
                 [&](const LightChoice& light) { light_surface_by(light, hit, surface, wo); });
  }
  light_surface_by(world_.lights.choose({g.bits[0], g.bits[1], g.bits[2]}, {hit.p, hit.shading.n}), hit,
                   surface, wo);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_surface_by(const LightChoice& choice, const SurfaceHit& hit,
                                            const SurfaceInfo& surface, const V3& wo) {
  const auto light = sample_light(choice, hit.p);
  if (!light || !turn_to(choice, hit)) return;
  const V3 wi = hit.shading.to_local(light->direction);
  // A shading normal must not let light through a surface that is opaque by its geometric normal. Sampled
  // directions are checked in the same way (scatter_on_surface).
  if ((wi.z > 0) != (dot(light->direction, hit.ng) > 0)) return;
  const BsdfEval f = world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wo, wi);
  if (is_black(f.f_cos) || (!light->delta && is_like_mirror(f.pdf, choice))) return;
  float sampled = f.pdf;
  if constexpr (F.aimed) sampled = near_lamps_.pdf(f.pdf, light->direction);
  const float weight = light->delta ? 1 : balance_weight(light->pdf, sampled);
  const V3 p = offset_point(hit, light->direction);
  const Within medium = beyond(hit, surface, light->direction, ray_.d, medium_);
  const C3 arriving = unoccluded(hit.p, p, *light, medium, stream_.stream(depth_, Purpose::track_shadow));
  if (!is_black(arriving))
    add_found(choice, hit.p, hit.ng, light->direction, beta_ * f.f_cos * arriving * (weight / light->pdf),
              [&] { return world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wi, wo).pdf; });
}

// At the path's first vertex: samples a second direction and adds half of the constant environment's light
// from there (aim.h). `numbers` are the random numbers of the path's own direction. Called only in scenes
// without media.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::look_for_sky(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& wo,
                                        Group numbers) {
  looked_for_sky_ = true;
  numbers.bits[0] = ~numbers.bits[0];
  numbers.bits[1] = ~numbers.bits[1];
  const auto s = sample_bsdf(hit, surface, wo, numbers);
  if (!s) return;
  LightSample sky;
  sky.direction = normalize(hit.shading.to_world(s->wi));
  if ((dot(sky.direction, hit.ng) > 0) != (s->wi.z > 0)) return;
  if (!is_finite(sky.direction)) {
    outcome_.reject(HealthCause::no_direction);
    return;
  }
  sky.distance = kInfinity;
  sky.radiance = world_.lights.constant_environment();
  // There are no media, so unoccluded() draws no random numbers
  const C3 arriving = unoccluded(hit.p, offset_point(hit, sky.direction), sky, medium_,
                                 stream_.stream(depth_, Purpose::track_shadow));
  if (!is_black(arriving)) add(beta_ * s->weight * arriving * .5f, world_.lights.sky_group());
}

}  // namespace ls::render
