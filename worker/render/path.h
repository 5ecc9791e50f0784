// The path tracer: one sample of radiance along a camera ray.
//
// State of a path: `beta`, its weight relative to the hero channel, and `density`, each channel's sampling
// density relative to the hero's (see medium.h). A contribution is beta * light / mean(density): the balance
// heuristic over channels. Direct light is found by directions from BSDF or phase function that hit a light
// and by next-event estimation, combined by the balance heuristic. At surfaces next-event estimation starts
// from the path's own vertices. What it does in media is a strategy, `Light` (vertex_light.h: the default;
// distant_mis.h), which has
//   Plan ahead(path, medium, segment)               before each flight through a medium: light scattered
//                                                   once, anywhere on the way;
//   Plan::matters()                                 whether vertices of the flight keep anything of it;
//   Vertex vertex(path, medium, plan, t)            what one that the flight made at t keeps;
//   void at_vertex(path, medium, p, d)              light scattered at that vertex;
//   Vertex::found_as_light(), (pivot)               the density of all that next-event estimation, over the
//                                                   flight's: of lights without a place, of those with this
//                                                   pivot. 1 for a default-constructed one, as on surfaces.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "worker/render/built.h"
#include "worker/render/light_split.h"
#include "worker/render/media_state.h"
#include "worker/render/mis.h"
#include "worker/render/path_end.h"
#include "worker/render/sampler.h"
#include "worker/render/segment.h"
#include "worker/render/vertex_light.h"
#include "worker/render/world.h"

namespace ls::render {

struct SampleOutcome {
  C3 radiance{0, 0, 0};
  HealthCause cut_off = HealthCause::none;  // the first cause for which it is rejected, whatever its radiance
  std::uint64_t majorant_violations = 0;

  void reject(HealthCause cause) {
    if (cut_off == HealthCause::none) cut_off = cause;
  }
};
struct FirstSurface;  // path_first.h

template <Features F, template <Features> class Light = VertexLight>
class PathTracer {
 public:
  // `split`: where the parts of the radiance are added up; needed with F.split, else not looked at.
  PathTracer(const World& world, const SampleStream& stream, LightSplit* split = nullptr)
      : world_(world), stream_(stream), split_(split) {}

  SampleOutcome trace(const CameraRay& ray);
  // The first surface at which the path is scattered where there are no media; for AOVs (path_first.h).
  std::optional<FirstSurface> first_surface(const CameraRay& ray);

 private:
  friend class Light<F>;
  struct Vertex {  // where the current ray was scattered from
    V3 p{0, 0, 0};
    V3 n{0, 0, 0};      // normal of its surface; 0 in a medium
    float pdf = 0;      // of the direction
    bool delta = true;  // chosen by a delta lobe or the camera: lights found are counted in full
    typename Light<F>::Vertex in_medium;
  };

  using Within = std::conditional_t<F.overlaps, MediaState, OneMedium>;

  // Up to the surface at `end`, else as far as `reach`.
  std::optional<float> scatter_in_media(const SurfaceHit* end, float reach);
  std::optional<float> scatter_in_medium(const Medium& medium, const SurfaceHit* end, float reach);
  std::optional<float> scatter_among(const SurfaceHit* end, float reach);
  void light_vertex(const Medium& medium, const V3& p, const V3& d);
  void add_glow_among(float t_max);
  float others_end(std::size_t but, int hero, float t_max, RandomStream streams);
  void add_glow(const Medium& medium, float t_max);
  std::optional<float> scatter_on_surface(const SurfaceHit& hit);
  bool passes_veil(const SurfaceHit& hit);
  bool may_scatter() const { return world_.depth_allows(depth_ + 1); }
  // Whether a segment is left after so many scatterings and as many boundaries and veils passed.
  bool may_go_on(int scatterings, int passed) const {
    return world_.depth_allows(scatterings + (world_.passing_counts ? passed : 0));
  }
  void pass_boundary(const SurfaceHit& hit, const SurfaceInfo& surface);
  void light_surface(const SurfaceHit& hit, const V3& wo);
  void add_emission(const SurfaceHit& hit);
  void add_environment();
  C3 unoccluded(const V3& start, const V3& p, const LightSample& light, const Within& medium,
                RandomStream stream);
  [[gnu::always_inline]] inline C3 through_boundaries(C3 value, const V3& start, const V3& p, const V3& d,
                                                      float left, Within medium, RandomStream stream);
  C3 through_media(const Within& media, const V3& from, const V3& d, float t, RandomStream& stream) const;
  Within start_medium() const;
  // `surface`: the hit's.
  [[gnu::always_inline]] inline Within beyond(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& w,
                                              const V3& from, Within in) const;
  void stand(const SurfaceInfo& s, bool outside, bool through, Within& in) const;
  Together others_at(const SurfaceHit& hit, const V3& from, const V3& w) const;
  [[gnu::noinline]] Within through_all(const SurfaceHit& hit, const V3& w, const V3& from, Within in) const;
  [[gnu::noinline]] void prefer_scatterer(SurfaceHit& hit, const V3& o, const V3& d, float t_max) const;
  [[gnu::noinline]] void add_emission_of_others(const SurfaceHit& hit);
  bool survives(float u);

  // `ahead`: of light that is scattered once more than the path so far, in the medium ahead of it.
  void add(const C3& weighted, bool ahead = false) {
    C3 light = weighted;
    if constexpr (F.chromatic) light = weighted / mean(density_);
    outcome_.radiance += light;
    if constexpr (F.split) {
      const bool in_medium = depth_ == 0 ? ahead : first_in_medium_;
      (*split_)[static_cast<std::size_t>(part_of(depth_ + ahead, in_medium))] += light;
    }
  }
  static float mean(const C3& c) { return (c.x + c.y + c.z) / 3; }
  void apply(const Flight& f) {
    beta_ *= f.weight;
    if constexpr (F.chromatic) density_ *= f.density;
  }
  // What a point that lies so from a point of a surface lacks of the offset that keeps it clear of it. Beyond
  // the surface it lacks more than all of it: a line that is nearly parallel to a curved surface leaves it
  // before the line from the moved start does, along which the way was measured.
  static V3 clear_of(const V3& offset, const V3& from_surface) {
    const float share = dot(from_surface, offset) / dot(offset, offset);
    return share < 1 ? offset * (1 - share) : V3(0);
  }
  // Where a ray is sent from that is scattered at t of a segment: as far from the surfaces at both ends as
  // rays that leave them. Rounding must not put it on the other side, where the medium has no end.
  V3 clear_of_ends(V3 p, Segment s, float t) const {
    const V3 from_end = s.end ? clear_of(offset_point(*s.end, -d_) - s.end->p, p - s.end->p) : V3(0);
    if (s.lead > 0) p += clear_of(o_ - start_, d_ * t);
    p += from_end;
    if (s.lead < 0 && !(dot(from_end, from_end) > 0)) [[unlikely]]
      p += back_off(t);
    return p;
  }
  // At a vertex of a medium.
  void stand_at(Segment s, float t) {
    const V3 p = start_ + d_ * t;
    last_.p = clear_of_ends(p, s, t);
    start_ = p;
    o_ = last_.p;
  }
  // Of a ray towards the surface that its start was moved away from, but that ends elsewhere: what the point
  // at t lacks of that distance.
  V3 back_off(float t) const {
    const V3 offset = o_ - start_;
    return offset * (1 - t * dot(offset, d_) / dot(offset, offset));
  }
  // From `start` along d to the surface that the ray from o met. Where o is farther from it than `start` - a
  // vertex in a medium that was moved away from this very surface - the way is measured to the surface's
  // plane: it may be a mean free path and more shorter (of a medium of optical depth 1e6).
  static float way_to(const SurfaceHit& hit, const V3& start, const V3& o, const V3& d) {
    const float lead = dot(o - start, d);
    if (lead < 0) [[unlikely]]
      return std::min(hit.t, std::max(0.f, dot(hit.p - start, hit.ng) / dot(d, hit.ng)));
    return hit.t + lead;
  }

  const World& world_;
  const SampleStream& stream_;
  LightSplit* split_;
  // Where the path stands, and where its next ray is sent from: moved off a surface, so that it does not meet
  // it again, or does from inside of what it bounds. A medium fills the way between them too (over a mean
  // free path of a medium of optical depth 1e6).
  V3 start_{0, 0, 0}, o_{0, 0, 0}, d_{0, 0, 1};
  C3 beta_{1, 1, 1}, density_{1, 1, 1};
  float eta_scale_ = 1;  // undoes the radiance scaling of refraction in roulette decisions
  int hero_ = 0;
  int depth_ = 0;    // scatterings so far
  int passed_ = 0;   // null boundaries and veils passed so far
  int segment_ = 0;  // rays so far, null crossings included
  Within medium_;
  bool first_in_medium_ = false;  // the first scattering was; with F.split
  Vertex last_;
  SampleOutcome outcome_;
  MediumCounters counters_;
};

template <Features F, template <Features> class Light>
SampleOutcome PathTracer<F, Light>::trace(const CameraRay& ray) {
  if (!world_.depth_allows(0)) return outcome_;
  start_ = o_ = ray.o;
  d_ = ray.d;
  last_.p = o_;
  if constexpr (F.media) medium_ = start_medium();
  if constexpr (F.chromatic) hero_ = std::min(2, static_cast<int>(3 * stream_.group(0, Purpose::hero).u(0)));
  float t_max = ray.t_max;
  for (segment_ = 0; segment_ < kMaxSegments; ++segment_, t_max = kInfinity) {
    SurfaceHit hit;
    const auto primitive = world_.accel.nearest(o_, d_, t_max);
    const bool met = primitive && world_.geometry.complete(*primitive, o_, d_, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident) prefer_scatterer(hit, o_, d_, kInfinity);
    }
    if constexpr (F.media) {
      if (medium_.any()) {
        if (const auto u = scatter_in_media(met ? &hit : nullptr, t_max)) {
          if (!survives(*u)) break;
          continue;
        }
        if (!world_.depth_allows(depth_) || is_black(beta_)) break;
      }
    }
    if (!met) {
      // A direction that is none meets nothing: a rejected sample, as one that was cut off before stays.
      if (!kBuilt.health || is_finite(d_))
        add_environment();
      else
        outcome_.reject(HealthCause::no_direction);
      break;
    }
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if constexpr (kBuilt.found_lights && F.overlaps) {
      if (world_.lights_on_others && surface.together > 0) add_emission_of_others(hit);
    }
    if (!surface.plain) {
      if (kBuilt.found_lights && surface.light != kNone) add_emission(hit);
      if constexpr (F.passing) {
        if ((kBuilt.boundaries && surface.null) || (kBuilt.veils && surface.veil && passes_veil(hit))) {
          if (!may_go_on(depth_, ++passed_)) break;
          pass_boundary(hit, surface);
          if (is_black(beta_)) break;
          continue;
        }
      }
    }
    const auto u = scatter_on_surface(hit);
    if (!u || !survives(*u)) break;
  }
  if (segment_ == kMaxSegments) outcome_.reject(HealthCause::too_many_surfaces);
  if constexpr (F.overlaps)
    if (medium_.overflowed()) outcome_.reject(HealthCause::nested_media);
  outcome_.majorant_violations = counters_.majorant_violations;
  return outcome_;
}

// A number for roulette: the path goes on from a vertex in the medium. Nothing: it reached the end of the
// segment, if there is one, or has ended on the way, with beta black.
template <Features F, template <Features> class Light>
std::optional<float> PathTracer<F, Light>::scatter_in_medium(const Medium& medium, const SurfaceHit* end,
                                                             float reach) {
  const float t_max = end ? way_to(*end, start_, o_, d_) : reach;
  const Segment segment{t_max, dot(o_ - start_, d_), end};
  if constexpr (F.emission) add_glow(medium, t_max);
  const auto plan = Light<F>::ahead(*this, medium, segment);
  const Group numbers = stream_.group(segment_, Purpose::flight);
  const Flight flight = free_flight<F>(medium, hero_, numbers.bits[0], start_, d_, t_max,
                                       stream_.stream(segment_, Purpose::track_flight), counters_);
  if (!flight.scattered) {
    apply(flight);
    return std::nullopt;
  }
  if (!may_scatter()) {
    beta_ = C3(0);
    return std::nullopt;
  }
  last_ = Vertex{};
  last_.delta = false;
  if (plan.matters()) last_.in_medium = Light<F>::vertex(*this, medium, plan, flight.t);
  stand_at(segment, flight.t);
  apply(flight);
  if constexpr (F.split) first_in_medium_ = first_in_medium_ || depth_ == 0;
  ++depth_;
  Light<F>::at_vertex(*this, medium, last_.p, d_);
  const Group direction = stream_.group(depth_, Purpose::direction);
  const PhaseSample s = medium.phase.sample(d_, {direction.u(0), direction.u(1)});
  last_.pdf = s.pdf;
  d_ = s.w;
  return direction.u(3);
}

// Next-event estimation at a surface.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_surface(const SurfaceHit& hit, const V3& wo) {
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  if (!world_.lights.can_sample() || !surface.smooth) return;
  const Group g = stream_.group(depth_, Purpose::light);
  const LightChoice choice = world_.lights.choose({g.bits[0], g.bits[1], g.bits[2]}, hit.p, hit.shading.n);
  const auto light = world_.lights.sample(choice, hit.p);
  if (!light) return;
  const V3 wi = hit.shading.to_local(light->direction);
  // The shading normal must not let light through a surface that the geometric one closes; the same for
  // sampled directions.
  if ((wi.z > 0) != (dot(light->direction, hit.ng) > 0)) return;
  const BsdfEval f = world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wo, wi);
  if (is_black(f.f_cos)) return;
  const float weight = !kBuilt.found_lights || light->delta ? 1 : balance_weight(light->pdf, f.pdf);
  const V3 p = offset_point(hit, light->direction);
  const Within medium = beyond(hit, surface, light->direction, d_, medium_);
  const C3 arriving = unoccluded(hit.p, p, *light, medium, stream_.stream(depth_, Purpose::track_shadow));
  if (!is_black(arriving)) add(beta_ * f.f_cos * arriving * (weight / light->pdf));
}

// A number for roulette, or nothing: absorbed, or too deep.
template <Features F, template <Features> class Light>
std::optional<float> PathTracer<F, Light>::scatter_on_surface(const SurfaceHit& hit) {
  if (!may_go_on(depth_ + 1, passed_)) return std::nullopt;
  ++depth_;
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  const V3 wo = hit.shading.to_local(-d_);
  light_surface(hit, wo);
  const Group g = stream_.group(depth_, Purpose::direction);
  const auto s = world_.bsdfs.sample(surface.bsdf, hit.uv_point(), wo, g.u(2), {g.u(0), g.u(1)});
  if (!s) return std::nullopt;
  const V3 w = normalize(hit.shading.to_world(s->wi));
  if ((dot(w, hit.ng) > 0) != (s->wi.z > 0)) return std::nullopt;  // through the true surface: no such light
  beta_ *= s->weight;
  if (s->transmitted) eta_scale_ *= s->eta * s->eta;
  last_ = Vertex{};
  last_.p = hit.p;
  last_.n = hit.shading.n;
  last_.pdf = s->pdf;
  last_.delta = s->delta;
  // Reflected rays too: what lies on either side of a surface is the scene's word (as for next-event
  // estimation).
  if constexpr (F.media) medium_ = beyond(hit, surface, w, d_, medium_);
  start_ = hit.p;
  o_ = offset_point(hit, w);
  d_ = w;
  return g.u(3);
}

// Whether the path goes straight on through a surface that lets a share of the light pass. Then it was not
// scattered there: it has no vertex, does not grow deeper, and a light that it finds is weighted against
// next-event estimation from the vertex before, whose shadow rays pass the surface with the same share
// (through_boundaries). The decision is keyed by the segment: the numbers of a vertex would be used again at
// the next one.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::passes_veil(const SurfaceHit& hit) {
  const BsdfIndex bsdf = world_.geometry.surfaces[hit.surface].bsdf;
  const Veil veil = world_.bsdfs.veil(bsdf, hit.uv_point(), hit.shading.to_local(-d_));
  if (!(veil.probability > 0)) return false;
  if (stream_.group(segment_, Purpose::veil).u(0) < veil.probability) {
    beta_ *= veil.transmission / veil.probability;
    return true;
  }
  beta_ /= 1 - veil.probability;
  return false;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::pass_boundary(const SurfaceHit& hit, [[maybe_unused]] const SurfaceInfo& surface) {
  start_ = hit.p;
  o_ = offset_point(hit, d_);
  if constexpr (F.media) medium_ = beyond(hit, surface, d_, d_, medium_);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission(const SurfaceHit& hit) {
  if (depth_ == 0 && world_.hide_emitters) return;
  const C3 emitted = world_.lights.emitted(hit, -d_);
  if (is_black(emitted)) return;
  float weight = 1;
  if (!last_.delta) {
    const float p_l = world_.lights.pdf(hit, last_.p, d_, last_.n);
    weight = balance_weight(last_.pdf, p_l * last_.in_medium.found_as_light(world_.lights.pivot(hit)));
  }
  add(beta_ * emitted * weight);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_environment() {
  if (!kBuilt.found_lights || !world_.lights.has_environment() || (depth_ == 0 && world_.hide_emitters))
    return;
  const float pdf = last_.pdf / last_.in_medium.found_as_light();
  add(beta_ * world_.lights.environment(d_, last_.delta ? kInfinity : pdf));
}

// Russian roulette; false ends the path.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::survives(float u) {
  if (is_black(beta_)) return false;
  if (depth_ < world_.rr_depth) return true;
  float size = max_component(beta_) * eta_scale_;
  if constexpr (F.chromatic) size /= mean(density_);
  const float q = std::min(size, forced_survival(depth_));
  if (q >= 1) return true;
  if (!(u < q)) return false;
  beta_ /= q;
  return true;
}

}  // namespace ls::render

#include "worker/render/path_first.h"
#include "worker/render/path_glow.h"
#include "worker/render/path_media.h"
#include "worker/render/path_overlap.h"
#include "worker/render/path_shadow.h"
