// Part of path_tracer.h, which includes it: the paths of a group of pixels share their tails, that is, the
// parts from their second vertices on and the light found there (Bekaert, Sbert, Halton 2002, "Accelerating
// path tracing by re-using paths").
//
// Let x_k be the first vertex of the path of pixel k, and q_k(y) the density per area or volume with which
// that path finds a second vertex y: the density of the direction, times that of a flight that ends at y,
// times the probabilities of passing every null-transmitting surface on the way and of not passing the one at
// y; 0 if something blocks the way. Each pixel i looks from x_i at the second vertex y_j of each path j of
// its group, and weights the light from there by the balance heuristic over all paths that could have found
// it: light that arrives at y_j along w has the estimate
//   beta_i f(x_i, y_j) V(x_i, y_j) f(y_j, w) L(w) / sum over k of q_k(y_j) p_k(w),
// where f are BSDFs or phase functions with cosines, V is the transmittance (0 if something blocks the way)
// times the geometric term, and p_k(w) is the density with which path k continues along w from y_j. For light
// found by next-event estimation, the density of next-event estimation replaces p_k or, if paths can also hit
// the light, is added to p_k. The group needs one shadow ray for each pair, and no path has to be followed
// again.
//
// A path whose weight becomes 0 ends there. So q_k(y) is 0 where x_k scatters no light from y, and p_k(w) is
// 0 where y scatters no light from w towards x_k.
//
// The densities of flights must be known, so media are homogeneous. Light on the segment from the first to
// the second vertex is not sampled equi-angularly: its density would have to be known for all k.
#pragma once

#include <algorithm>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <utility>

#include "worker/render/world/world.h"

namespace ls::render {

// Records the path's current vertex as its first vertex, if the path was never scattered before (depth_ is
// 1).
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::begin_sharing(const SurfaceHit* hit, const Medium* medium) {
  FirstVertex& first = sharing_.first;
  if (depth_ != 1) return;
  first.usable = true;
  first.at.medium = medium;
  first.at.p = hit ? hit->p : last_.p;
  if (hit) first.at.hit = *hit;
  first.d = ray_.d;
  first.around = medium_;
  first.passed = passed_;
  first.beta = beta_;
  if constexpr (F.chromatic) {
    first.beta /= mean(density_);
    first.density = density_ / mean(density_);
  }
}

// Called after a smooth lobe sampled the direction at the first vertex. Moves the weight of the path to
// SharingPath::scale, so that beta_ is the weight from the first vertex on, and makes the channels' densities
// relative to their mean.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::look_for_second() {
  sharing_.part = SharingPath::Part::second;
  sharing_.scale = beta_;
  if constexpr (F.chromatic) {
    sharing_.scale /= mean(density_);
    density_ /= mean(density_);
  }
  sharing_.survival = max_component(sharing_.scale);
  beta_ = C3(1);
}

// Begins the tail at the second vertex, with next-event estimation. `accepts` returns false for directions
// from which light must not be added.
template <Features F, template <Features> class Light>
template <class Accepts>
void PathTracer<F, Light>::begin_tail(const PathVertex& at, const LightPlace& place, const V3& start,
                                      const Accepts& accepts) {
  SharedTail& tail = sharing_.tail;
  tail.usable = true;
  tail.at = at;
  tail.passed = passed_;
  if (!world_.lights.can_sample()) return;
  const Group g = stream_.group(depth_, Purpose::light);
  const LightChoice choice = world_.lights.choose({g.bits[0], g.bits[1], g.bits[2]}, place);
  const auto light = world_.lights.sample(choice, at.p);
  if (!light || !accepts(light->direction)) return;
  const V3 p = at.medium ? at.p : offset_point(at.hit, light->direction);
  const Within medium =
      at.medium ? medium_
                : beyond(at.hit, world_.geometry.surfaces[at.hit.surface], light->direction, ray_.d, medium_);
  const C3 arriving = unoccluded(start, p, *light, medium, stream_.stream(depth_, Purpose::track_shadow));
  if (is_black(arriving)) return;
  tail.to_light = light->direction;
  tail.light_pdf = light->pdf;
  tail.light_is_delta = light->delta;
  tail.light = arriving;
  tail.light_group = group_of(choice);
}

// Continues the path from the second vertex along w, which a smooth lobe sampled with this weight.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::go_on_as_tail(const V3& w, const C3& weight) {
  sharing_.tail.goes_on = true;
  sharing_.tail.onward = w;
  sharing_.part = SharingPath::Part::tail;
  if constexpr (F.split) tail_by_group_.clear(split_->groups);
  C3 size = sharing_.scale * beta_ * weight;
  if constexpr (F.chromatic) {
    size /= mean(density_);
    density_ /= mean(density_);
  }
  sharing_.survival = max_component(size);
  beta_ = C3(1);
}

// Stores the light of a light source, of this light group, that the ray from the path's second vertex hit.
// Next-event estimation would find this light with the density `pdf`.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::keep_emitted(const C3& emitted, float pdf, LightGroup group) {
  sharing_.tail.emitted = beta_ * emitted;
  if constexpr (F.chromatic) sharing_.tail.emitted /= mean(density_);
  sharing_.tail.hit_pdf = pdf;
  sharing_.tail.emitted_group = group;
}

// Returns the BSDF at the path's first vertex, on a surface, for light from wi in its local frame. On a
// diffuse surface it is evaluated once for each side.
template <Features F, template <Features> class Light>
BsdfEval PathTracer<F, Light>::scattered_at_first(const V3& wi) {
  FirstVertex& x = sharing_.first;
  const SurfaceHit& hit = x.at.hit;
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  const auto eval = [&](const V3& w) {
    return world_.bsdfs.eval(surface.bsdf, hit.uv_point(), hit.shading.to_local(-x.d), w);
  };
  if (!surface.diffuse || wi.z == 0) return eval(wi);
  std::optional<BsdfEval>& known = x.by_side[wi.z < 0];
  if (!known) known = eval({0, 0, std::copysign(1.f, wi.z)});
  const float cosine = std::abs(wi.z);
  return {known->f_cos * cosine, known->pdf * cosine};
}

// Computes how the vertex y of a tail looks from this path's first vertex x (struct Look). `own` is true for
// the path's own tail, whose vertex y is visible from x.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::look_at(const SharedTail& tail, bool own) -> Look {
  Look look;
  const FirstVertex& x = sharing_.first;
  const PathVertex& y = tail.at;
  const V3 f = y.p - x.at.p;
  const float r2 = dot(f, f);
  if (!x.usable || !(r2 > 0)) return look;
  const V3 w = f / std::sqrt(r2);
  C3 value;
  float pdf = 0, cosine = 1;
  V3 origin = x.at.p;
  OneMedium around = x.around;
  if (x.at.medium) {
    const PhaseValue<F> phase = x.at.medium->template phase_value<F>(x.at.p, x.d, w);
    pdf = phase.pdf;
    value = C3(phase.value);
  } else {
    const SurfaceHit& hit = x.at.hit;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    const V3 wi = hit.shading.to_local(w);
    if ((wi.z > 0) != (dot(w, hit.ng) > 0)) return look;
    const BsdfEval eval = scattered_at_first(wi);
    value = eval.f_cos;
    pdf = eval.pdf;
    origin = offset_point(hit, w);
    around = beyond(hit, surface, w, x.d, around);
  }
  value *= x.beta;
  if (!(pdf > 0) || is_black(value)) return look;
  LightSample end;
  end.target = y.p;
  if (!y.medium) {
    const V3 back = y.hit.shading.to_local(-w);
    // If the shading normal at y faces away from x, a path from x would have the geometric normal in its
    // place at y (SurfaceHit::normal_replaced), and so another BSDF. It cannot use this tail.
    if ((back.z > 0) != (dot(w, y.hit.ng) < 0)) return look;
    cosine = std::abs(dot(w, y.hit.ng));
    end.target = offset_target(y.hit, x.at.p, -w);
    const SurfaceInfo& surface = world_.geometry.surfaces[y.hit.surface];
    if (surface.null_transmission)
      pdf *= 1 - world_.bsdfs.null_transmission(surface.bsdf, y.hit.uv_point(), back).probability;
  }
  C3 through;
  if (own) {
    for (int c = 0; c < 3; ++c) through[c] = std::exp(-tail.depth[c]);
    sharing_.flight = through * tail.passing;
    through *= tail.transmission;
  } else {
    end.direction = w;
    end.distance = std::sqrt(r2);
    end.radiance = C3(1);
    depth_ = 1;
    passed_ = x.passed;
    sharing_.flight = C3(1);
    sharing_.crossed = 0;
    // The stream is not used without media, where unoccluded() draws no random numbers
    RandomStream stream(0);
    if constexpr (F.media) stream = stream_.stream(1, Purpose::track_connect);
    through = unoccluded(x.at.p, origin, end, around, stream);
    // If passed surfaces count towards the maximum depth, the number passed before a tail limits the tail's
    // length. So only paths that passed the same number can use the tail.
    if (is_black(through) || (world_.passing_counts && x.passed + sharing_.crossed != tail.passed))
      return look;
  }
  const float geometry = cosine / r2;
  look.w = w;
  look.value = value * through * geometry;
  C3 found = x.density * sharing_.flight;
  if (y.medium) {
    look.value *= y.medium->sigma_s;
    found *= y.medium->sigma_t;
  }
  look.density = pdf * geometry * mean(found);
  return look;
}

// Returns the BSDF or phase function at the vertex y of a tail, for light from the direction w and a path
// that arrives along `d`.
template <Features F, template <Features> class Light>
BsdfEval PathTracer<F, Light>::scattered_at(const PathVertex& y, const V3& d, const V3& w) const {
  if (y.medium) {
    const PhaseValue<F> phase = y.medium->template phase_value<F>(y.p, d, w);
    return {C3(phase.value), phase.pdf};
  }
  return world_.bsdfs.eval(world_.geometry.surfaces[y.hit.surface].bsdf, y.hit.uv_point(),
                           y.hit.shading.to_local(-d), y.hit.shading.to_local(w));
}

// Evaluates the BSDF or phase function at the second vertex of the path `giver`, whose tail is shared, for
// light from one direction, towards the first vertices of a group. On a diffuse surface it is evaluated once
// for each side of the surface.
template <Features F, template <Features> class Light>
class PathTracer<F, Light>::TowardsGroup {
 public:
  TowardsGroup(const PathTracer& giver, const V3& from) : giver_(giver), from_(from) {
    const PathVertex& y = giver.sharing_.tail.at;
    diffuse_ = !y.medium && giver.world_.geometry.surfaces[y.hit.surface].diffuse;
  }
  // Returns the BSDF or phase function towards a first vertex; d is the direction from that vertex to the
  // second vertex.
  BsdfEval operator()(const V3& d) {
    const PathVertex& y = giver_.sharing_.tail.at;
    const float z = diffuse_ ? dot(y.hit.shading.n, d) : 0;
    if (z == 0) return giver_.scattered_at(y, d, from_);
    std::optional<BsdfEval>& known = by_side_[z < 0];
    if (!known) known = giver_.scattered_at(y, d, from_);
    return *known;
  }

 private:
  const PathTracer& giver_;
  V3 from_;
  bool diffuse_;
  std::array<std::optional<BsdfEval>, 2> by_side_;
};

// Sorts the paths so that neighbours can share much: first the paths whose first vertices are in media, by
// depth along the ray; then those with first vertices on surfaces, in their given order; then those that
// share nothing. If the vertices on surfaces were sorted too, the same neighbours would share in every
// sample, and their common errors would show as spots. In media the depths, and so the neighbours, differ
// from sample to sample.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::sort_to_share(std::span<PathTracer*> paths) {
  const auto key = [](const PathTracer* path) {
    const FirstVertex& first = path->sharing_.first;
    if (!first.usable) return std::pair(2, 0.f);
    return first.at.medium ? std::pair(0, dot(first.at.p, first.d)) : std::pair(1, 0.f);
  };
  if constexpr (F.media)
    std::ranges::stable_sort(paths, {}, key);
  else
    std::ranges::stable_partition(paths, [](const PathTracer* path) { return path->sharing_.first.usable; });
}

// Adds to each path of the group the light of the tails of all paths of the group.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::share(std::span<PathTracer* const> group) {
  struct Seen {
    Look look;
    // Values of the BSDF or phase function at the first vertex y_j of the tail, for light that is scattered
    // from there to the vertex x_i of the path that receives it: `lit` for the light that next-event
    // estimation found at y_j, `onward` for the light that arrives along the rest of the tail
    C3 lit, onward;
  };
  boost::container::static_vector<Seen, kMostSharing> seen(group.size());
  const auto onward_pdf = [](const BsdfEval& eval) { return is_black(eval.f_cos) ? 0 : eval.pdf; };
  for (PathTracer* const giver : group) {
    const SharedTail& tail = giver->sharing_.tail;
    if (!tail.usable || !tail.brings_light()) continue;
    float lit = 0, scattered = 0, emitted = 0;  // denominators, sums over k, of the estimates of light
    TowardsGroup from_light(*giver, tail.to_light), from_onward(*giver, tail.onward);
    for (std::size_t k = 0; k < group.size(); ++k) {
      Seen& s = seen[k];
      s.look = group[k]->look_at(tail, group[k] == giver);
      if (!(s.look.density > 0)) continue;
      if (tail.light_pdf > 0) {
        const BsdfEval eval = from_light(s.look.w);
        s.lit = eval.f_cos;
        lit += s.look.density * (tail.light_is_delta ? tail.light_pdf : tail.light_pdf + onward_pdf(eval));
      }
      if (tail.goes_on) {
        const BsdfEval eval = from_onward(s.look.w);
        s.onward = eval.f_cos;
        scattered += s.look.density * onward_pdf(eval);
        emitted += s.look.density * (onward_pdf(eval) + tail.hit_pdf);
      }
    }
    for (std::size_t k = 0; k < group.size(); ++k) {
      const Seen& s = seen[k];
      if (!(s.look.density > 0)) continue;
      C3 light(0);
      if (lit > 0) light += s.lit * tail.light / lit;
      if (scattered > 0) light += s.onward * tail.scattered / scattered;
      if (emitted > 0) light += s.onward * tail.emitted / emitted;
      group[k]->add_shared(s.look.value * light);
      if constexpr (F.split) {
        const auto add = [&](LightGroup of, const C3& part) {
          group[k]->add_shared_to_group(of, s.look.value * part);
        };
        if (lit > 0) add(tail.light_group, s.lit * tail.light / lit);
        if (emitted > 0) add(tail.emitted_group, s.onward * tail.emitted / emitted);
        if (!(scattered > 0)) continue;
        for (std::size_t g = 0; g < giver->tail_by_group_.groups; ++g)
          add(static_cast<LightGroup>(g), s.onward * giver->tail_by_group_.scattered[g] / scattered);
      }
    }
  }
  // If a path was cut off (SampleOutcome::cut_off), all samples of the group are rejected, since the light of
  // its tail is missing in all of them
  for (const PathTracer* giver : group) {
    if (giver->outcome_.cut_off == HealthCause::none) continue;
    for (PathTracer* path : group) path->outcome_.reject(giver->outcome_.cut_off);
  }
}

}  // namespace ls::render
