// Part of path_tracer.h, which includes it: the light of surfaces that the path's ray hits, and of the
// environment if it leaves the scene, weighted against next-event estimation at the vertex that it left.
#pragma once

#include "worker/render/integrator/mis.h"
#include "worker/render/world/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission(const SurfaceHit& hit) {
  if (depth_ == 0 && world_.hide_emitters) return;
  if constexpr (F.visibility) {
    if (depth_ > 0 && world_.ray_flags) {
      const LightReach& reach = reach_of(hit);
      if (!scene::linked(reach.receivers, links_.receiver) || found_by_shadows(reach)) return;
    }
  }
  add_emission_times(beta_, hit);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission_times(const C3& beta, const SurfaceHit& hit) {
  const C3 emitted = world_.lights.emitted(hit, -ray_.d);
  if (is_black(emitted)) return;
  see_surface(hit.p);
  float weight = 1;
  if (!hits_count_fully(hit)) {
    const float p_l =
        this->light_pdf(hit, last_.p, ray_.d, last_.place, last_.in_medium.light_chosen_first());
    if constexpr (F.reuse) {
      if (is_leaving_second()) {
        keep_emitted(emitted, p_l, world_.lights.group(hit));
        return;
      }
    }
    weight = balance_weight(last_.pdf, p_l * last_.in_medium.found_as_light(light_pivot(hit)));
  }
  add(beta * emitted * weight, F.split ? world_.lights.group(hit) : kNoLightGroup);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_environment() {
  if (!world_.lights.has_environment()) return;
  see_environment();
  if (depth_ == 0 && world_.hide_environment) return add_environment_seen();
  if constexpr (F.visibility) {
    if (depth_ > 0 && world_.ray_flags) {
      add_environment_times(beta_, false);
      return;
    }
  }
  if constexpr (F.reuse) {
    if (is_leaving_second()) {
      const Lights::EnvironmentParts parts = world_.lights.environment_parts(last_.p, ray_.d, last_.place);
      keep_emitted(parts.sampled, parts.pdf, parts.group);
      add(beta_ * parts.unsampled, world_.lights.sky_group());
      return;
    }
  }
  const float pdf = last_.pdf / last_.in_medium.found_as_light();
  C3 light = world_.lights.environment(last_.p, ray_.d, last_.delta ? kInfinity : pdf, last_.place);
  if constexpr (F.connected) {
    if (connections_.learner && !last_.delta && !is_black(light)) {
      ++connections_.learner->left;
      connections_.learner->found_sky(last_.p, ray_.d, mean(beta_ * light));
    }
  }
  const bool half_sky = depth_ == 1 && looked_for_sky_;
  if (half_sky) light -= world_.lights.constant_environment() * .5f;
  add(beta_ * light, kNoLightGroup);
  if constexpr (F.split) {
    if (split_->groups == 0) return;
    world_.lights.environment_by_group(
        last_.p, ray_.d, last_.delta ? kInfinity : pdf, last_.place,
        [&](LightGroup group, const C3& part) { add_to_group(group, beta_ * part); });
    if (half_sky)
      add_to_group(world_.lights.sky_group(), beta_ * world_.lights.constant_environment() * -.5f);
  }
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_environment_seen() {
  if (world_.hide_emitters || world_.transparent) return;
  const C3 light = world_.lights.environment_seen(ray_.d);
  if (is_black(light)) return;
  add(beta_ * light, kNoLightGroup);
  if constexpr (F.split)
    world_.lights.environment_seen_by_group(
        ray_.d, [&](LightGroup group, const C3& part) { add_to_group(group, beta_ * part); });
}

}  // namespace ls::render
