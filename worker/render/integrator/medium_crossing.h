// Part of path_tracer.h, which includes it: flights through media, medium emission, and the media on either
// side of a surface. A *null* surface is index-matched: light passes it unchanged.
//
// Where several media overlap, their particles are independent: a flight ends at the first collision in any
// of them, and the transmittance is the product of their transmittances. The phase function at a vertex is
// that of the medium in which the collision occurred; no mixture is needed.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/base/work_counters.h"
#include "worker/render/integrator/equiangular.h"
#include "worker/render/media/emission.h"
#include "worker/render/world/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::fly(const SurfaceHit* end, float reach, const std::optional<Flight>& flown)
    -> Step {
  if constexpr (F.overlaps) {
    if (medium_.several()) return fly_through_several(end, reach);
  }
  return fly_through(world_.media[medium_.one()], end, reach, flown);
}

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::fly_through(const Medium& medium, const SurfaceHit* end, float reach,
                                       [[maybe_unused]] const std::optional<Flight>& flown) -> Step {
  const float t_max = end ? ray_.length_to(*end) : reach;
  const Segment segment{t_max, ray_.lead(), end};
  if constexpr (kFliesFirst) {
    // The flight that was sampled before the ray was traced is kept, and only cut off at t_max. A new flight
    // up to t_max could differ from it even before t_max: where t_max cuts off part of a dense cell of a
    // grid, free_flight() may use another algorithm in the rest of the cell (kExactDepth). The ray was traced
    // because of where `flown` ends, so a new flight in its place would bias the image.
    if (flown)
      return collide(medium, segment, {}, flown->scattered && flown->t < t_max ? *flown : Flight{.t = t_max});
  }
  if constexpr (F.emission) add_medium_emission(medium, t_max);
  const auto plan = Light<F>::ahead(*this, medium, segment);
  const Flight flight = flight_through(medium, t_max);
  if constexpr (F.reuse) {
    if (looks_for_second()) sharing_.tail.depth += medium.sigma_t * (flight.scattered ? flight.t : t_max);
  }
  return collide(medium, segment, plan, flight);
}

template <Features F, template <Features> class Light>
Flight PathTracer<F, Light>::flight_through(const Medium& medium, float t_max) {
  const Group numbers = stream_.group(segment_, Purpose::flight);
  if (F.aimed && world_.lamp_flights && !medium.grid && std::isfinite(t_max))
    return fly_past_lamps<F>(medium, hero_, numbers, ray_.start, ray_.d, t_max, world_.lamps);
  return free_flight<F>(medium, hero_, numbers.bits[0], ray_.start, ray_.d, t_max,
                        stream_.stream(segment_, Purpose::track_flight), counters_);
}

// Scatters the path where the flight ends, if it ends in the medium.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::collide(const Medium& medium, Segment segment, const typename Light<F>::Plan& plan,
                                   const Flight& flight) -> Step {
  if (!flight.scattered) {
    apply(flight);
    return {Collision::escaped};
  }
  if (!may_scatter()) return {Collision::absorbed};
  [[maybe_unused]] Vertex previous;
  if constexpr (F.connected) previous = last_;
  last_ = Vertex{};
  last_.delta = false;
  if (plan.matters()) last_.in_medium = Light<F>::vertex(*this, medium, plan, flight.t);
  [[maybe_unused]] const LightPlace place = place_on(segment);
  begin_vertex(segment, flight);
  if constexpr (F.aimed) near_lamps_ = LampDirections(world_.lamps, last_.p);
  if constexpr (F.connected) {
    learn_lights(place, [&](const LightChoice& light) { light_vertex_by(light, medium, last_.p, ray_.d); });
    arrive(previous, last_.p, V3(0));
    prefetch_light_vertices();
  }
  if constexpr (F.reuse) {
    begin_sharing(nullptr, &medium);
    if (looks_for_second())
      begin_tail({last_.p, &medium, {}}, last_.place, ray_.start, [](const V3&) { return true; });
    else
      Light<F>::at_vertex(*this, medium, last_.p, ray_.d);
  } else {
    Light<F>::at_vertex(*this, medium, last_.p, ray_.d);
  }
  if constexpr (F.connected) connect_in(medium, last_.p, ray_.d);
  if constexpr (F.emission) look_for_emission_in(medium, ray_.d);
  return scatter_in(medium);
}

// Scatters the path at its vertex in the medium. If paths split there (roulette.h), first follows a second
// path from the vertex on, and adds the light that it finds.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::scatter_in(const Medium& medium) -> Step {
  if constexpr (kSplits) {
    if (depth_ == 1 && world_.paths_split && medium.grid) {
      refer_to_first_vertex();
      beta_ *= .5f;
      reference_ *= .5f;
      PathTracer other(*this);
      other.stream_ = stream_.of_branch();
      other.outcome_ = {};
      other.counters_ = {};
      const Step step = other.scatter_by_phase(medium);
      if (other.survives(step.roulette)) {
        ++other.segment_;
        other.go_on(kInfinity);
      }
      outcome_.radiance += other.outcome_.radiance;
      outcome_.majorant_violations += other.outcome_.majorant_violations;
      if (other.outcome_.cut_off != HealthCause::none) outcome_.reject(other.outcome_.cut_off);
    }
  }
  return scatter_by_phase(medium);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::begin_vertex(Segment segment, const Flight& flight) {
  bool by_segment = world_.lights.local_in_media();
  // All paths of a group that could have found the light of a tail must choose its light source alike
  // (path_reuse.h), so the choice depends on the vertex alone. No light is chosen before this vertex.
  if constexpr (F.reuse) by_segment = by_segment && !looks_for_second();
  if (by_segment) last_.place = place_on(segment);
  see(ray_.start + ray_.d * flight.t);
  ray_.advance_to(segment, flight.t);
  last_.p = ray_.origin;
  if (!by_segment) last_.place.p = last_.p;
  apply(flight);
  if constexpr (F.split) first_in_medium_ = first_in_medium_ || depth_ == 0;
  if constexpr (F.visibility) left_medium_ = true;
  ++depth_;
}

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::scatter_by_phase(const Medium& medium) -> Step {
  const Group direction = stream_.group(depth_, Purpose::direction);
  const V2 u(direction.u(0), direction.u(1));
  [[maybe_unused]] const C3 before = beta_;
  PhaseSample s = medium.sample_phase<F>(last_.p, ray_.d, u, beta_);
  if constexpr (F.connected) last_.sum = densities_.sum(s.pdf);
  if constexpr (F.aimed) {
    aim_ = 1;
    if (near_lamps_.any()) {
      float choice = direction.u(2);
      if (const auto w = near_lamps_.sample(choice, u)) {
        const PhaseValue<F> own = medium.phase_value<F>(last_.p, ray_.d, *w);
        s = {*w, own.pdf};
        if constexpr (F.phases) beta_ = before * (own.pdf > 0 ? own.value / own.pdf : C3(0));
      }
      const float own = s.pdf;
      s.pdf = near_lamps_.pdf(own, s.w);
      aim_ = own / s.pdf;
      beta_ *= aim_;
      if constexpr (F.connected) last_.sum = densities_.sum(own);
    }
  }
  last_.pdf = s.pdf;
  ray_.d = s.w;
  if constexpr (F.emission) emissive_.pdf = -1;
  if constexpr (F.visibility) {
    if (world_.ray_flags) [[unlikely]] {
      links_.receiver = world_.medium_links[index_of(medium)];
      like_mirror_ = false;
      direct_due_ = !world_.shadow_lists.empty();
    }
  }
  if constexpr (F.reuse) {
    if (looks_for_second())
      go_on_as_tail(s.w, C3(1));
    else if (depth_ == 1 && !is_black(beta_))
      look_for_second();
  }
  return {Collision::scattered, direction.u(3)};
}

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::fly_through_several(const SurfaceHit* end, float reach) -> Step {
  const float t_max = end ? ray_.length_to(*end) : reach;
  const Segment segment{t_max, ray_.lead(), end};
  if constexpr (F.emission) add_medium_emission_among(t_max);
  RandomStream streams = stream_.stream(segment_, Purpose::overlap);
  const Medium* met = nullptr;
  std::size_t winner = 0;
  Flight flight;
  flight.t = t_max;
  const auto media = medium_.all();
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::uint32_t bits = streams.bits();
    const Medium& m = world_.media[media[i]];
    const Flight f =
        free_flight<F>(m, hero_, bits, ray_.start, ray_.d, flight.t, RandomStream(streams.next()), counters_);
    if (!f.scattered) continue;
    flight = f;
    met = &m;
    winner = i;
  }
  for (std::size_t i = 0; i < media.size(); ++i)
    if (!met || i != winner) apply(passed(world_.media[media[i]], hero_, ray_.start, ray_.d, flight.t));
  if (!met) return {Collision::escaped};
  if (!may_scatter()) return {Collision::absorbed};
  last_ = Vertex{};
  last_.delta = false;
  begin_vertex(segment, flight);
  if constexpr (F.aimed) near_lamps_ = LampDirections(world_.lamps, last_.p);
  light_vertex(*met, last_.p, ray_.d);
  if constexpr (F.emission) look_for_emission_in(*met, ray_.d);
  return scatter_in(*met);
}

// Next-event estimation at a vertex p in a medium, where no equi-angular points on the segment are sampled.
// Its MIS weight therefore takes account only of phase-function sampling. d is the direction of travel before
// the scattering.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_vertex(const Medium& medium, const V3& p, const V3& d) {
  const Lights& lights = world_.lights;
  if (!lights.can_sample()) return;
  const Group g = stream_.group(depth_, Purpose::light);
  light_vertex_by(lights.choose({g.bits[0], g.bits[1], g.bits[2]}, last_.place), medium, p, d);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_vertex_by(const LightChoice& choice, const Medium& medium, const V3& p,
                                           const V3& d) {
  const auto light = sample_light(choice, p);
  if (!light || !turn_to(choice, medium)) return;
  const PhaseValue<F> phase = medium.phase_value<F>(p, d, light->direction);
  const float sampled = direction_pdf(p, phase.pdf, light->direction);
  const float weight = light->delta ? 1 : light->pdf / (light->pdf + sampled);
  const C3 arriving =
      unoccluded(ray_.start, p, *light, medium_, stream_.stream(depth_, Purpose::track_shadow));
  if (!is_black(arriving)) add(beta_ * arriving * (phase.value * weight / light->pdf), group_of(choice));
}

// For each medium, adds its emission up to the point where a flight through the other media ends. The
// probability that this flight reaches a point is the transmittance of the other media up to there. Each
// colour channel has a flight of its own, as its extinction may differ, but all use the same random numbers.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_medium_emission_among(float t_max) {
  if (depth_ == 0 && world_.hide_emitters) return;
  RandomStream streams = stream_.stream(segment_, Purpose::overlap_emission);
  const auto media = medium_.all();
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::uint64_t key = streams.next();
    const Medium& m = world_.media[media[i]];
    if (m.emission_kind == EmissionKind::none) continue;
    std::array<float, 3> ends;
    for (int c = 0; c < 3; ++c)
      ends[static_cast<std::size_t>(c)] = others_end(i, c, t_max, RandomStream(key));
    const auto up_to = [&](float most) {
      C3 light(0);
      float last = -1;
      C3 up_to_last;
      for (int c = 0; c < 3; ++c) {
        const float t = std::min(ends[static_cast<std::size_t>(c)], most);
        if (t != last) {
          up_to_last = m.grid ? emission_of_grid(m, ray_.start, ray_.d, t, RandomStream(mix64(key)))
                              : closed_emission(m, t);
          last = t;
        }
        light[c] = up_to_last[c];
      }
      return light;
    };
    const C3 light = up_to(t_max);
    if (!is_black(light)) add_along(light, m, t_max, up_to);
  }
}

template <Features F, template <Features> class Light>
float PathTracer<F, Light>::others_end(std::size_t but, int hero, float t_max, RandomStream streams) {
  const auto media = medium_.all();
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::uint32_t bits = streams.bits();
    const RandomStream stream(streams.next());
    if (i == but) continue;
    const Flight f =
        free_flight<F>(world_.media[media[i]], hero, bits, ray_.start, ray_.d, t_max, stream, counters_);
    if (f.scattered) t_max = f.t;
  }
  return t_max;
}

// Returns the emission of a medium that is no grid along the first part, of length t, of the segment ahead.
template <Features F, template <Features> class Light>
C3 PathTracer<F, Light>::closed_emission(const Medium& medium, float t) const {
  if constexpr (F.height) {
    if (medium.height) return emission_of_height(medium, ray_.start, ray_.d, t);
  }
  return emission_of_length(medium, t);
}

// Adds the medium's emission along the whole segment ahead, of length t_max, independently of where the
// path's flight will end. Like a light that is hit, the emission counts at the path's current depth.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_medium_emission(const Medium& medium, float t_max) {
  if (medium.emission_kind == EmissionKind::none || (depth_ == 0 && world_.hide_emitters)) return;
  LS_COUNT(medium_emission);
  const auto up_to = [&](float t) {
    return medium.grid
               ? emission_of_grid(medium, ray_.start, ray_.d, t, stream_.stream(segment_, Purpose::emission))
               : closed_emission(medium, t);
  };
  const C3 light = up_to(t_max);
  if (!is_black(light)) add_along(light, medium, t_max, up_to);
}

// Adds `total`, the emission of the medium on the segment ahead, of length t_max. up_to(t) returns that of
// the first part of the segment. It uses the same random numbers for any t, so that the parts of the emission
// in the slices of a deep image are each right on average, and add up to the whole.
template <Features F, template <Features> class Light>
template <class UpTo>
void PathTracer<F, Light>::add_along(const C3& total, const Medium& medium, [[maybe_unused]] float t_max,
                                     [[maybe_unused]] const UpTo& up_to) {
  const LightGroup group = medium.light_group;
  if constexpr (F.split) {
    LightByDepth& deep = split_->by_depth;
    if (deep.wanted && depth_ == 0) [[unlikely]] {
      deep.wanted = false;
      add(beta_ * total, group);
      deep.wanted = true;
      C3 weight = beta_;
      if constexpr (F.chromatic) weight /= mean(density_);
      const float begin = deep.depth(ray_.start, ray_.d);
      float from = begin;
      C3 before(0);
      for (const float edge : deep.edges) {
        if (!(edge > from)) continue;
        if (!(edge - begin < t_max)) break;
        const C3 now = up_to(edge - begin);
        deep.see(from);
        deep.add(weight * (now - before));
        from = edge;
        before = now;
      }
      deep.see(from);
      deep.add(weight * (total - before));
      return;
    }
  }
  add(beta_ * total * emissive_weight(medium), group);
}

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::start_medium(const CameraRay& ray) const -> Within {
  Within in;
  const auto at_lens = [&] {
    if constexpr (F.overlaps)
      if (world_.overlaps) return void(in = world_.camera_media);
    in.only(world_.camera_medium);
  };
  at_lens();
  if (world_.hidden_boundaries) [[unlikely]]
    for_hidden_boundaries(world_, ray, [&](const SurfaceHit& hit, const SurfaceInfo& surface) {
      in = beyond(hit, surface, ray.d, ray.d, in);
    });
  return in;
}

// Returns the media on the side of the surface that w points to, for a path that arrives along `from` through
// the media `in`. Null and hidden surfaces that coincide with this surface are crossed together with it;
// there are such surfaces only with F.overlaps.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::beyond(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& w,
                                  const V3& from, Within in) const -> Within {
  if constexpr (F.media) {
    if (!(F.overlaps ? surface.borders : surface.transition)) return in;
    const bool outside = dot(w, hit.ng) > 0;
    if constexpr (F.overlaps) {
      const bool through = outside == (dot(from, hit.ng) > 0);
      if (surface.coincident_reach > 0 && through) return through_all(hit, w, from, in);
      stand(surface, outside, through, in);
    } else {
      in.only(outside ? surface.exterior : surface.interior);
    }
  }
  return in;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::stand(const SurfaceInfo& s, bool outside, bool through, Within& in) const {
  if (world_.overlaps) return in.stand(s, outside, through, world_.media);
  if (s.transition) in.only(outside ? s.exterior : s.interior);
}

// Returns the primitives that coincide with the primitive of `hit`, for a ray that arrives along `from` and
// continues along w. A short ray finds them. It begins before the surface, by the offset that covers
// everything that coincides with it, but not before the origin of the ray that arrives. It ends at the origin
// of the ray that continues.
template <Features F, template <Features> class Light>
CoincidentHits PathTracer<F, Light>::others_at(const SurfaceHit& hit, const V3& from, const V3& w) const {
  const V3 back = offset_point(hit, -w) - hit.p;
  const float share = hit.t * std::abs(dot(from, back)) / dot(back, back);
  CoincidentHits all = between(hit.p + back * std::min(1.f, share), offset_point(hit, w));
  const auto end = std::remove(all.ids.begin(), all.ids.begin() + all.count, hit.primitive);
  all.count = static_cast<int>(end - all.ids.begin());
  return all;
}

// Returns the media after crossing the hit surface and all null or hidden surfaces that coincide with it. The
// boundaries that the path leaves are handled before those that it enters. Otherwise, where two cells of one
// mesh share a wall, the path would for a moment be inside the mesh's boundary twice, as it is at no point of
// the scene.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::through_all(const SurfaceHit& hit, const V3& w, const V3& from, Within in) const
    -> Within {
  const CoincidentHits others = others_at(hit, from, w);
  const V3 o = offset_point(hit, -w), d = normalize(offset_point(hit, w) - o);
  for (const bool outside : {true, false}) {
    const SurfaceInfo& own = world_.geometry.surfaces[hit.surface];
    if ((dot(w, hit.ng) > 0) == outside) stand(own, outside, true, in);
    for (int i = 0; i < others.count; ++i) {
      SurfaceHit other;
      if (!complete(others.ids[static_cast<std::size_t>(i)], o, d, other)) continue;
      const SurfaceInfo& s = world_.geometry.surfaces[other.surface];
      if (s.passable && (dot(d, other.ng) > 0) == outside) stand(s, outside, true, in);
    }
  }
  return in;
}

// If `hit` is on a null surface that coincides with a scattering surface, replaces it by the ray's hit on the
// scattering surface. The ray from o along d may have found either of them first. If the null surface were
// used, the boundary of fog on a floor would let light through the floor, and a pane of glass on a null
// boundary would not attenuate the light. Surfaces beyond t_max are ignored: shadow rays end there, in front
// of the surface of their light.
//
// With kHidden, surfaces that are hidden from rays of this kind are treated like null surfaces, and a ray
// that hits one of them gets its hit on a null surface that it meets, if no other scatters it: such a
// surface may give off light.
template <Features F, template <Features> class Light>
template <bool kHidden>
void PathTracer<F, Light>::prefer_scatterer(SurfaceHit& hit, const V3& o, const V3& d, float t_max,
                                            [[maybe_unused]] RayKind kind) const {
  const auto is_passed = [&](std::uint32_t surface) {
    if constexpr (kHidden) return is_hidden(surface, kind);
    return false;
  };
  const SurfaceInfo& s = world_.geometry.surfaces[hit.surface];
  if (!(s.null || is_passed(hit.surface)) || !(s.coincident_reach > 0)) return;
  const bool hidden = is_passed(hit.surface);
  const CoincidentHits others = others_at(hit, d, d);
  for (int i = 0; i < others.count; ++i) {
    SurfaceHit other;
    const PrimitiveId id = others.ids[static_cast<std::size_t>(i)];
    if (!complete(id, o, d, other)) continue;
    const SurfaceInfo& info = world_.geometry.surfaces[other.surface];
    if ((info.null && !hidden) || is_passed(other.surface) || other.t > t_max) continue;
    hit = other;
    if (!info.null) return;
  }
}

// Adds the emission of all null surfaces that coincide with the surface of `hit`. The ray has found only one
// of these surfaces, but next-event estimation, against which their light is weighted, finds all of them.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission_of_others(const SurfaceHit& hit) {
  const CoincidentHits others = others_at(hit, ray_.d, ray_.d);
  for (int i = 0; i < others.count; ++i) {
    SurfaceHit other;
    if (!complete(others.ids[static_cast<std::size_t>(i)], ray_.origin, ray_.d, other)) continue;
    const SurfaceInfo& s = world_.geometry.surfaces[other.surface];
    if constexpr (F.visibility) {
      if (s.hidden.has(ray_kind()) || (depth_ == 0 && s.holdout)) continue;
    }
    if (s.null && s.light != kNone) add_emission(other);
  }
}

}  // namespace ls::render
