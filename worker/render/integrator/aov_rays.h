// Part of path_tracer.h, which includes it: what AOVs find along the sample's own camera ray. They use no
// random number of the path, but for the decisions at surfaces that light passes straight through.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/image/aov/aov.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Finds the surface that the current ray meets, not farther than `reach`. Where several coincide it is one
// that scatters a ray of this kind, if there is one.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::meet(SurfaceHit& hit, float reach, RayKind kind) const {
  const auto primitive = nearest(ray_.origin, ray_.d, reach);
  if (!primitive || !complete(*primitive, ray_.origin, ray_.d, hit)) return false;
  if (world_.coincident) prefer_scatterer<true>(hit, ray_.origin, ray_.d, kInfinity, kind);
  return true;
}

// The path passes every index-matched or hidden surface, and each null-transmitting surface with that
// surface's probability. As long as the ray hits the same surfaces as the path of the sample, the decisions
// use the same random numbers as in trace().
template <Features F, template <Features> class Light>
std::optional<FirstSurface> PathTracer<F, Light>::first_surface(const CameraRay& ray) {
  ray_ = begin(ray);
  float t_max = ray.t_max;
  FirstSurface first;
  SurfaceHit& hit = first.hit;
  for (segment_ = 0; segment_ < kMaxSegments; ++segment_, t_max = kInfinity) {
    if (!meet(hit, t_max, RayKind::camera)) return std::nullopt;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    beta_ = C3(1);
    if (!sees_past(hit, surface)) {
      first.not_passed = beta_.x;
      return first;
    }
    ray_.origin = offset_point(hit, ray_.d);
  }
  return std::nullopt;
}

// A medium on the way contributes in proportion to the light that it scatters or absorbs: its albedo replaces
// that of the surface behind, and it has no normal. The proportion is 1 - transmittance, and the
// transmittance is exact in homogeneous media. If flights were sampled instead, the guides would be noisy,
// and a denoiser keeps the noise of its guides.
template <Features F, template <Features> class Light>
DenoisingGuide PathTracer<F, Light>::denoising_guide(const CameraRay& ray) {
  constexpr int kGuideSegments = 16;
  DenoisingGuide guide;
  double unscattered = 1;
  bool direct = true;  // true before the first mirror or glass
  ray_ = begin(ray);
  medium_ = start_medium(ray);
  float reach = ray.t_max;
  for (segment_ = 0; segment_ < kGuideSegments; ++segment_, reach = kInfinity) {
    SurfaceHit hit;
    const bool met = meet(hit, reach, direct ? RayKind::camera : RayKind::surface);
    if (medium_.any()) {
      const float t = met ? ray_.length_to(hit) : reach;
      RandomStream tracker = stream_.stream(segment_, Purpose::track_guide);
      const C3 through = through_media(medium_, ray_.start, ray_.d, t, tracker);
      const V3 middle = std::isfinite(t) ? ray_.start + ray_.d * (t / 2) : ray_.start;
      guide.albedo += beta_ * (C3(1) - through) * world_.media[medium_.one()].albedo_at(middle);
      beta_ *= through;
      unscattered *= double{mean(through)};
    }
    if (!met || is_black(beta_)) break;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (surface.hidden.has(direct ? RayKind::camera : RayKind::surface) || surface.null ||
        (surface.null_transmission && passes_null(hit))) {
      pass_boundary(hit, surface);
      continue;
    }
    if (surface.holdout && direct) break;
    direct = false;
    const Group g = stream_.group(segment_, Purpose::guide);
    const auto s = world_.bsdfs.sample(surface.bsdf, hit.uv_point(), hit.shading.to_local(-ray_.d), g.u(2),
                                       {g.u(0), g.u(1)});
    if (!s) break;
    // A refracted sample's weight contains 1 / eta^2, by which refraction scales radiance. This factor is
    // removed, since it is no property of the surface behind.
    beta_ *= s->weight * (s->transmitted ? s->eta * s->eta : 1.f);
    if (!s->delta) {
      guide.albedo += beta_;
      guide.normal = V3d(hit.shading.n) * (dot(hit.shading.n, ray_.d) > 0 ? -unscattered : unscattered);
      break;
    }
    const V3 w = normalize(hit.shading.to_world(s->wi));
    medium_ = beyond(hit, surface, w, ray_.d, medium_);
    ray_.leave(hit, w);
  }
  return guide;
}

// In grids the transmittance is an estimate, whose random numbers nothing else uses. The estimates between
// the slices of a deep image use the same numbers, so that those of neighbouring slices are close to each
// other, and the last one is that of the whole.
template <Features F, template <Features> class Light>
Opacity PathTracer<F, Light>::opacity(const CameraRay& ray, const DeepTransmittance* deep) {
  const float near = deep ? world_.camera.near_distance(ray) : 0;
  const auto depth_of = [&](const V3& p) { return near + dot(p - ray.o, ray.d); };
  const auto mean_of = [](const C3& c) { return (double{c.x} + c.y + c.z) / 3; };
  std::size_t edge = 0;
  // Sets the transmittances of the edges up to the depth `end` that are not set yet.
  const auto pass_edges = [&](float end, const auto& through) {
    for (; edge < deep->edges.size() && deep->edges[edge] <= end; ++edge)
      deep->through[edge] = mean_of(through(deep->edges[edge]));
  };
  // Transmittances of the media, and of the surfaces that light passes straight through
  C3 media(1), surfaces(1), shadow(0);
  ray_ = begin(ray);
  medium_ = start_medium(ray);
  float reach = ray.t_max;
  for (segment_ = 0; segment_ < kMaxSegments; ++segment_, reach = kInfinity) {
    SurfaceHit hit;
    const bool met = meet(hit, reach, RayKind::camera);
    // The depth at which the hit counts
    float at = kInfinity;
    if (deep && met) [[unlikely]] {
      const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
      const bool seen = !surface.null && !surface.hidden.has(RayKind::camera);
      at = seen ? depth_in(deep->surfaces, depth_of(hit.p)) : depth_of(hit.p);
    }
    if (medium_.any()) {
      const float t = met ? ray_.length_to(hit) : reach;
      RandomStream tracker = stream_.stream(segment_, Purpose::track_opacity);
      if (deep) [[unlikely]] {
        const float begin = depth_of(ray_.start), end = met ? at : begin + reach;
        std::array<float, kMostDeepSlices> points;
        std::array<C3, kMostDeepSlices> through, all;
        std::size_t count = 0;
        while (edge + count < deep->edges.size() && deep->edges[edge + count] <= end) {
          points[count] = std::clamp(deep->edges[edge + count] - begin, 0.f, t);
          all[count++] = media * surfaces;
        }
        C3 whole(1);
        for (const std::uint32_t m : medium_.all()) {
          whole *=
              transmittance_to_points(world_.media[m], ray_.start, ray_.d, t, RandomStream(tracker.next()),
                                      {points.data(), count}, through.data());
          for (std::size_t i = 0; i < count; ++i) all[i] *= through[i];
        }
        media *= whole;
        for (std::size_t i = 0; i < count; ++i) deep->through[edge++] = mean_of(all[i]);
      } else {
        media *= through_media(medium_, ray_.start, ray_.d, t, tracker);
      }
    }
    if (deep) [[unlikely]]
      pass_edges(at, [&](float) { return media * surfaces; });
    if (!met && deep) [[unlikely]]
      deep->through.back() = mean_of(media * surfaces);
    if (!met && world_.lights.has_sky() && !world_.hide_environment) surfaces = C3(0);
    if (!met || is_black(media)) break;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (!sees_past(hit, surface)) {
      if (!surface.holdout) surfaces = C3(0);
      if (surface.catcher && world_.aovs.has(Aov::shadow_catcher))
        shadow = shadow_at(hit) * mean(media * surfaces);
      if (deep) [[unlikely]] {
        pass_edges(kInfinity, [&](float) { return media * surfaces; });
        deep->through.back() = mean_of(media * surfaces);
      }
      break;
    }
    surfaces = beta_;
    pass_boundary(hit, surface);
  }
  return {C3(1) - media * surfaces, C3(1) - media, shadow};
}

// Returns one sample of Opacity::shadow at a shadow catcher, for a share of 1. The light is the irradiance on
// the side that the camera sees: of a light that is chosen as by next-event estimation, and of the part of
// the environment that is not sampled as a light. Other catchers keep their light in both estimates, since
// their shadows are in the picture that the image will be laid over.
template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::shadow_at(const SurfaceHit& hit) {
  const auto to_viewer = [&](const V3& n) { return dot(n, ray_.d) > 0 ? -n : n; };
  const V3 n = to_viewer(hit.shading.n), ng = to_viewer(hit.ng);
  float lit = 0, unlit = 0;
  const auto receive = [&](const LightSample& light, float weight, int number) {
    if (!(dot(light.direction, n) > 0) || !(dot(light.direction, ng) > 0)) return;
    const V3 p = offset_point(hit, light.direction);
    const C3 arriving =
        unoccluded(hit.p, p, light, medium_, stream_.stream(number, Purpose::track_shadow_catcher));
    if (is_black(arriving) && meets_catcher(p, light)) return;
    lit += mean(arriving) * weight;
    unlit += mean(light.radiance) * weight;
  };
  const Group g = stream_.group(0, Purpose::shadow_catcher), sky = stream_.group(1, Purpose::shadow_catcher);
  if (world_.lights.can_sample()) {
    const LightChoice choice = world_.lights.choose({g.bits[0], g.bits[1], g.bits[2]}, {hit.p, n});
    const auto light = sample_light(choice, hit.p);
    if (light && turn_to(choice, hit)) receive(*light, dot(light->direction, n) / light->pdf, 0);
  }
  if (!is_black(world_.lights.constant_environment()) &&
      turn_to(world_.lights.sky_reach(), RayKind::surface, world_.surface_links[hit.surface])) {
    LightSample light;
    light.direction = normalize(Frame(n).to_world(cosine_hemisphere({sky.u(0), sky.u(1)})));
    light.distance = kInfinity;
    light.radiance = world_.lights.constant_environment();
    receive(light, kPi, 1);
  }
  return {lit, 1, unlit};
}

// True if the way from p to the light meets a shadow catcher.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::meets_catcher(const V3& p, const LightSample& light) const {
  V3 o = p, d = light.direction;
  float left = light.distance;
  if (std::isfinite(left)) {
    const V3 way = light.target - p;
    left = std::sqrt(dot(way, way));
    if (!(left > 0)) return false;
    d = way / left;
  }
  for (int i = 0; i < kMaxShadowSegments; ++i) {
    SurfaceHit hit;
    const auto primitive = nearest(o, d, left);
    if (!primitive || !complete(*primitive, o, d, hit)) return false;
    if (world_.coincident) prefer_scatterer<true>(hit, o, d, left, RayKind::shadow);
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (surface.catcher && !surface.null && !is_hidden(hit.surface, RayKind::shadow)) return true;
    const V3 next = offset_point(hit, d);
    if (std::isfinite(left)) left -= dot(next - o, d);
    if (!(left > 0)) return false;
    o = next;
  }
  return false;
}

template <Features F, template <Features> class Light>
DeepProbe PathTracer<F, Light>::deep_probe(const CameraRay& ray) {
  // A ray that passes more surfaces than this ends; the slices are then coarser behind them.
  constexpr int kProbeSegments = 64;
  DeepProbe probe;
  const float near = world_.camera.near_distance(ray);
  const auto depth_of = [&](const V3& p) { return near + dot(p - ray.o, ray.d); };
  ray_ = begin(ray);
  medium_ = start_medium(ray);
  float reach = ray.t_max;
  for (segment_ = 0; segment_ < kProbeSegments; ++segment_, reach = kInfinity) {
    SurfaceHit hit;
    const bool met = meet(hit, reach, RayKind::camera);
    if (medium_.any()) {
      const float begin = depth_of(ray_.start);
      DeepSegment& segment = probe.segments.emplace_back();
      segment = {begin, met ? depth_of(hit.p) : begin + reach, ray_.start, ray_.d, probe.reaches, {}};
      for (const std::uint32_t m : medium_.all()) segment.media.push_back(&world_.media[m]);
    }
    if (!met) return probe;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (!sees_past(hit, surface)) {
      probe.surface = depth_of(hit.p);
      return probe;
    }
    const bool others_shine = world_.lights_on_others && surface.coincident_reach > 0;
    const bool shines = surface.light != kNone && !is_black(world_.lights.emitted(hit, -ray_.d));
    if ((shines || others_shine) && !world_.hide_emitters && !surface.hidden.has(RayKind::camera))
      probe.lamps.push_back(depth_of(hit.p));
    probe.reaches = std::max(0.f, mean(beta_));
    pass_boundary(hit, surface);
  }
  return probe;
}

}  // namespace ls::render
