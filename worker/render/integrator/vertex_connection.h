// Part of path_tracer.h, which includes it: connects the vertices of a camera path to light vertices, the
// points at which paths from the sun were scattered (lights/light_vertices.h). Also records what learning
// paths find (Connections::Learner). Learning paths are camera paths that are traced before the first sample
// to find out where light comes from.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "worker/render/base/features.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Sets `densities_` (SubpathDensities), from which the balance heuristic weights strategies, for the camera
// subpath that ends at the vertex p. The path reaches p from the vertex `from`. ng is the geometric normal if
// p is on a surface, and 0 in a medium. `densities_` stays 0 if `from` is the camera or has scattered the
// path by a delta lobe. Then no strategy finds the same path with a shorter camera subpath, since it would
// have to connect `from` to a light vertex.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::arrive(const Vertex& from, const V3& p, const V3& ng) {
  if (connections_.learner) ++connections_.learner->scatterings;
  densities_ = {};
  const V3 f = p - from.p;
  if (!from.delta && dot(f, f) > 0)
    densities_ = SubpathDensities::extended(f, from.pdf, from.sum, ng, from.ng);
}

// If this is a learning path from which the choice of lights by place is learned (lights/local_lights.h),
// estimates the light that each light source adds at `place`, and records the estimates. look_for(choice)
// does the next-event estimation with one light.
template <Features F, template <Features> class Light>
template <class LookFor>
void PathTracer<F, Light>::learn_lights(const LightPlace& place, const LookFor& look_for) {
  if (!connections_.learner || !connections_.learner->keeps_lights) return;
  const C3 beta = std::exchange(beta_, C3(1)), radiance = outcome_.radiance;
  Connections::Learner* const learner = std::exchange(connections_.learner, nullptr);
  RandomStream numbers = stream_.stream(depth_, Purpose::guide);
  std::vector<float> found;
  for (std::uint32_t i = 0; i < world_.lights.count(); ++i) {
    outcome_.radiance = C3(0);
    const std::uint32_t x = numbers.bits(), y = numbers.bits();
    look_for(world_.lights.choice_of(i, 1, {0, x, y}));
    found.push_back(mean(outcome_.radiance));
  }
  learner->lights.add(place.p, place.n, found);
  connections_.learner = learner;
  beta_ = beta;
  outcome_.radiance = radiance;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::connect_in(const Medium& medium, const V3& p, const V3& d) {
  struct InMedium {
    const PathTracer& path;
    const Medium& medium;
    V3 p, d;
    C3 value(const V3& w, float& pdf) const {
      const PhaseValue<F> phase = medium.phase_value<F>(p, d, w);
      pdf = path.direction_pdf(p, phase.pdf, w);
      return C3(phase.value);
    }
    float back(const V3& w) const { return medium.phase_value<F>(p, d, w).pdf; }
    float cosine(const V3&) const { return 1; }
    V3 origin(const V3&) const { return p; }
    Within media(const V3&) const { return path.medium_; }
  };
  Receiver x;
  x.p = p;
  x.d = d;
  x.g = medium.phase.g;
  x.in_medium = true;
  connect(x, ray_.start, InMedium{*this, medium, p, d});
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::connect_on(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& wo) {
  struct OnSurface {
    const PathTracer& path;
    const SurfaceHit& hit;
    const SurfaceInfo& surface;
    V3 wo;
    C3 value(const V3& w, float& pdf) const {
      const V3 wi = hit.shading.to_local(w);
      if ((wi.z > 0) != (dot(w, hit.ng) > 0)) return C3(0);
      const BsdfEval f = path.world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wo, wi);
      pdf = f.pdf;
      if constexpr (F.aimed) pdf = path.near_lamps_.pdf(f.pdf, w);
      return f.f_cos;
    }
    float back(const V3& w) const {
      return path.world_.bsdfs.eval(surface.bsdf, hit.uv_point(), hit.shading.to_local(w), wo).pdf;
    }
    float cosine(const V3& w) const { return std::abs(dot(w, hit.ng)); }
    V3 origin(const V3& w) const { return offset_point(hit, w); }
    Within media(const V3& w) const { return path.beyond(hit, surface, w, path.ray_.d, path.medium_); }
  };
  Receiver x;
  x.p = hit.p;
  x.n = wo.z > 0 ? hit.shading.n : -hit.shading.n;
  x.both_sides = surface.crossed;
  connect(x, hit.p, OnSurface{*this, hit, surface, wo});
}

// Connects the vertex x of the camera path to one light vertex, and adds the light that arrives this way.
// `start` is the position of x before it was moved off its surface; lengths in media are measured from there.
template <Features F, template <Features> class Light>
template <class Scattering>
void PathTracer<F, Light>::connect(const Receiver& x, const V3& start, const Scattering& scattering) {
  if (connections_.learner && densities_.last > 0) ++connections_.learner->vertices;
  if (!connections_.vertices) return;
  const Group g = stream_.group(depth_, Purpose::connect);
  const auto choice = connections_.vertices->choose(x, g.bits[0], g.u(1));
  if (!choice.vertex) return;
  const LightVertex& y = *choice.vertex;
  if (!world_.depth_allows(depth_ + y.scatterings)) return;
  const V3 f = y.p - x.p;
  const float r2 = dot(f, f);
  if (!(r2 > 0)) return;
  const V3 w = f / std::sqrt(r2);
  float pdf = 0;
  C3 value = scattering.value(w, pdf);
  if (is_black(value)) return;
  LightSample light;
  light.direction = w;
  light.distance = std::sqrt(r2);
  light.radiance = C3(1);
  light.target = y.p;
  // At the light vertex y: cos_y is the cosine between the geometric normal and the connection (1 in media),
  // camera_pdf the density with which a camera path that comes from x samples the direction to the sun, and
  // light_pdf the density with which a light path samples the direction to x.
  float cos_y = 1, camera_pdf = 0, light_pdf = 0;
  if (y.medium == kNone) {
    // Next-event estimation does not find the sun in a direction that is on different sides of the shading
    // normal and of the geometric normal ng (light_surface), so neither does a connection.
    const V3 to_x = y.hit.shading.to_local(-w), to_light = y.hit.shading.to_local(y.to_light);
    if ((to_light.z > 0) != (dot(y.to_light, y.hit.ng) > 0)) return;
    // There is no connection either if x is on different sides of the two normals, because a camera path that
    // arrives from there uses ng as its shading normal.
    if ((to_x.z > 0) != (dot(w, y.hit.ng) < 0)) return;
    cos_y = std::abs(dot(w, y.hit.ng));
    const BsdfIndex bsdf = world_.geometry.surfaces[y.hit.surface].bsdf;
    const BsdfEval f_y = world_.bsdfs.eval(bsdf, y.hit.uv_point(), to_x, to_light);
    value *= f_y.f_cos * cos_y;
    camera_pdf = direction_pdf(y.p, f_y.pdf, y.to_light);
    if (densities_.last > 0) light_pdf = world_.bsdfs.eval(bsdf, y.hit.uv_point(), to_light, to_x).pdf;
    light.target = offset_target(y.hit, start, -w);
  } else {
    const PhaseValue<F> phase = world_.media[y.medium].template phase_value<F>(y.p, w, y.to_light);
    value *= phase.value;
    camera_pdf = direction_pdf(y.p, phase.pdf, y.to_light);
    light_pdf = phase.pdf;
  }
  const float from_camera = pdf * cos_y * y.densities.sum(camera_pdf);
  float from_light = 0;
  if (densities_.last > 0)
    from_light = light_pdf * scattering.cosine(w) * densities_sum([&] { return scattering.back(w); });
  // The balance heuristic gives the weight r2 / (r2 + from_camera + from_light); the geometric term of the
  // connection has the factor 1 / r2. This is their product.
  const float weight = 1 / (r2 + from_camera + from_light);
  C3 added = beta_ * value * y.light * (weight * choice.weight);
  const float size = mean(added);
  if (!(size > 0)) return;
  if (size < world_.faint) {
    if (!(g.u(2) * world_.faint < size)) return;
    added *= world_.faint / size;
  }
  ++depth_;
  const C3 arriving = unoccluded(start, scattering.origin(w), light, scattering.media(w),
                                 stream_.stream(depth_, Purpose::track_connect));
  if (!is_black(arriving))
    add(added * arriving, F.split ? world_.lights.group(world_.sun.light) : kNoLightGroup);
  --depth_;
}

// Traces a path from the sun that begins with the ray `from`, and calls keep(y) for each of its vertices y.
// At a surface the next direction is sampled as for a camera path that arrives from the same side. But the
// BSDF by which the light is multiplied is evaluated with the two directions exchanged, because the light
// travels the other way.
template <Features F, template <Features> class Light>
template <class Keep>
void PathTracer<F, Light>::follow_light(const SunMap::Ray& from, const Keep& keep) {
  ray_ = {from.o, from.o, world_.sun.direction};
  if constexpr (F.media) medium_.only(kNone);
  beta_ = world_.sun.irradiance / from.density;
  const float first = mean(beta_);
  LightVertex y;
  const auto reach = [&](const V3& p, const V3& ng) {
    last_.p = y.p;
    y.p = p;
    y.to_light = -ray_.d;
    y.densities = y.scatterings++ == 0
                      ? SubpathDensities{1 / first_density(from.density, ng), 0}
                      : SubpathDensities::extended(p - last_.p, last_.pdf, last_.sum, ng, last_.ng);
    y.light = beta_ / (is_black(ng) ? 1 : std::abs(dot(ng, ray_.d)));
    last_.ng = ng;
    keep(y);
  };
  const auto leave = [&](float pdf, float camera_pdf) {
    last_.pdf = pdf;
    last_.sum = y.densities.sum(direction_pdf(y.p, camera_pdf, y.to_light));
  };
  for (segment_ = 0; segment_ < kMaxSegments; ++segment_) {
    SurfaceHit& hit = y.hit;
    hit.normal_replaced = false;
    const auto primitive = world_.accel.nearest(ray_.origin, ray_.d, kInfinity);
    if (!primitive || !world_.geometry.complete(*primitive, ray_.origin, ray_.d, hit)) return;
    const Medium* medium = nullptr;  // the medium that scatters the light; null: a surface does
    if constexpr (F.media) {
      if (medium_.any()) {
        const Medium& around = world_.media[medium_.one()];
        const Segment segment{ray_.length_to(hit), ray_.lead(), &hit};
        const Flight flight = free_flight<F>(around, hero_, stream_.group(segment_, Purpose::flight).bits[0],
                                             ray_.start, ray_.d, segment.length,
                                             stream_.stream(segment_, Purpose::track_flight), counters_);
        apply(flight);
        if (is_black(beta_)) return;
        if (flight.scattered) {
          medium = &around;
          ray_.advance_to(segment, flight.t);
        }
      }
    }
    if (medium) {
      y.medium = medium_.one();
      reach(ray_.origin, V3(0));
      const Group g = stream_.group(y.scatterings, Purpose::direction);
      const PhaseSample s = medium->sample_phase<F>(y.p, ray_.d, {g.u(0), g.u(1)}, beta_);
      leave(s.pdf, s.pdf);
      ray_.d = s.w;
    } else {
      const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
      if (surface.null || (surface.null_transmission && passes_null(hit))) {
        pass_boundary(hit, surface);
        if (is_black(beta_)) return;
        continue;
      }
      const float cosine = std::abs(dot(ray_.d, hit.ng));
      const V3 to_light = hit.shading.to_local(-ray_.d);
      // The path ends if next-event estimation would not find its light here (light_surface): if all lobes
      // are delta lobes, or if the light is on different sides of the shading normal and of the geometric
      // normal ng.
      if (!surface.smooth || !(cosine > 0) || (to_light.z > 0) != (dot(ray_.d, hit.ng) < 0)) return;
      if (hit.normal_replaced) return;
      y.medium = kNone;
      reach(hit.p, hit.ng);
      const Group g = stream_.group(y.scatterings, Purpose::direction);
      const auto s = world_.bsdfs.sample(surface.bsdf, hit.uv_point(), to_light, g.u(2), {g.u(0), g.u(1)});
      if (!s || s->delta) return;
      const V3 w = normalize(hit.shading.to_world(s->wi));
      // The path ends if the new direction is on different sides of the shading normal and of ng, because a
      // camera path that arrives from there uses ng as its shading normal.
      if ((s->wi.z > 0) != (dot(w, hit.ng) > 0)) return;
      const BsdfEval f = world_.bsdfs.eval(surface.bsdf, hit.uv_point(), s->wi, to_light);
      beta_ *= f.f_cos * (std::abs(dot(w, hit.ng)) / (s->pdf * cosine));
      leave(s->pdf, f.pdf);
      if constexpr (F.media) medium_ = beyond(hit, surface, w, ray_.d, medium_);
      ray_.leave(hit, w);
    }
    if (!world_.depth_allows(y.scatterings + 2) || is_black(beta_)) return;
    const float q = std::min(mean(beta_) / first, y.scatterings < kMostUnforced ? 1 : kForcedLight);
    if (q < 1) {
      if (!(stream_.group(y.scatterings, Purpose::direction).u(3) < q)) return;
      beta_ /= q;
    }
  }
}

}  // namespace ls::render
