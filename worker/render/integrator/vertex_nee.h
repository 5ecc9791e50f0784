// The default strategy of path_tracer.h for light in media. It combines three strategies: (1) next-event
// estimation at each vertex, (2) phase-function sampling that hits a light, and (3) next-event estimation at
// points sampled equi-angularly about the light on each segment. In homogeneous media (3) is used for every
// light with a position; in grids it is used for point lights, on the part of a segment that has any density
// (docs/decisions/0011-equi-angular-points-in-grids.md).
//
// At distance t on a segment, (1) and (2) sample t with the free-flight density f(t), and (3) with the
// equi-angular density e(t). Let p_l and p_s be the solid-angle densities of light sampling and
// phase-function sampling. The balance-heuristic weights are proportional to (1) f p_l, (2) f p_s, (3) e p_l.
// Only the ratio e / f matters: equiangular_ratio() below. In grids f is the density of flights through the
// macro cells' means (optical_depth.h): weights need not use the true density, only the same function of the
// vertex for all strategies.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/base/features.h"
#include "worker/render/integrator/equiangular.h"
#include "worker/render/integrator/offset_ray.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/optical_depth.h"
#include "worker/render/world/roulette.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The density with which a free flight ends at the point `at_point`, averaged over the three choices of the
// hero (the channel that decides distances: medium.h). `density` is each channel's density of the path so
// far, relative to that of the hero.
template <Features F>
float flight_pdf(const Medium& m, [[maybe_unused]] const C3& density, const DepthPoint& at_point) {
  if constexpr (F.chromatic) {
    float num = 0;
    for (int c = 0; c < 3; ++c) num += density[c] * (m.sigma_t[c] * std::exp(-m.sigma_t[c] * at_point.x));
    return at_point.rate * (num / 3 / ((density.x + density.y + density.z) / 3));
  } else {
    const float s = m.sigma_t.x * std::exp(-m.sigma_t.x * at_point.x);
    return at_point.rate * ((s + s + s) / 3);
  }
}

// The ratio e / f at one point. f may underflow to 0 at points where flights do end, because it is computed
// from the macro cells' means. All strategies then use the ratio kMaxRatio.
inline float ratio_to_flight(float e, float f) { return f > 0 ? std::min(e / f, kMaxRatio) : kMaxRatio; }

template <Features F>
class VertexNee {
 public:
  struct Plan {
    float length = 0;  // length of the segment if it is also sampled equi-angularly, else 0

    bool matters() const { return length > 0; }
  };
  // A vertex in a medium. o, d and length are the start, the direction and the length of the part of the
  // segment that has any density; t is the distance from o to the vertex, and flight_pdf is f there.
  struct Vertex {
    bool equiangular = false, points_only = false;
    V3 o{0, 0, 0}, d{0, 0, 0};
    float length = 0, t = 0, flight_pdf = 0;

    bool uses_equiangular(bool is_point) const {
      return equiangular && (is_point || !(F.grids && points_only));
    }
    // The ratio e / f at this vertex for a light with this pivot (the point about which segments are
    // sampled). Valid only for lights that are sampled equi-angularly (uses_equiangular).
    float equiangular_ratio(const Pivot& pivot) const {
      return ratio_to_flight(EquiAngular(o, d, length, pivot).pdf(t), flight_pdf);
    }
    // For a light that the path hit after this vertex, as in strategy (2): the density with which (1) and (3)
    // sample this vertex, divided by the density f of the flight. Such a light is never a point light.
    float found_as_light(const Pivot& pivot) const {
      return uses_equiangular(false) ? 1 + equiangular_ratio(pivot) : 1.f;
    }
    static float found_as_light() { return 1; }
    // Returns false: strategy (1) chooses its light when the vertex is known, and not by
    // Lights::choose_before_point().
    static bool light_chosen_first() { return false; }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment) {
    if (medium.equiangular_mode == EquiangularMode::none) return {};
    // The second vertex of a path whose tail is shared is not sampled equi-angularly (path_reuse.h).
    if (path.looks_for_second()) return {};
    if (!path.may_scatter() || !(points_only(medium) || std::isfinite(segment.length))) return {};
    sample_equiangular(path, medium, segment);
    return {segment.length};
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    Vertex v;
    const OpticalDepthIn<F> depths(medium, path.ray_.start, path.ray_.d, plan.length);
    v.points_only = points_only(medium);
    v.o = path.ray_.start + path.ray_.d * depths.from();
    v.d = path.ray_.d;
    v.length = depths.to() - depths.from();
    v.t = t - depths.from();
    const DepthPoint at_point = depths.at(t);
    v.flight_pdf = flight_pdf<F>(medium, path.density_, at_point);
    // Equi-angular sampling is assumed to find this vertex even if the flight density underflows to 0,
    // because sample_equiangular() samples points there too.
    v.equiangular = at_point.rate > 0 && v.length > 0;
    return v;
  }

  // Strategy (1): samples a light and adds its light that is scattered at the vertex p. d is the direction of
  // travel before the scattering.
  template <class Path>
  static void at_vertex(Path& path, const Medium& medium, const V3& p, const V3& d) {
    const Lights& lights = path.world_.lights;
    if (!lights.can_sample()) return;
    const Group g = path.stream_.group(path.depth_, Purpose::light);
    const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]}, path.last_.place);
    const auto light = path.sample_light(choice, p);
    if (!light || !path.turn_to(choice, medium)) return;
    const PhaseValue<F> phase = medium.phase_value<F>(p, d, light->direction);
    const auto& v = path.last_.in_medium;
    const float with_equiangular = v.uses_equiangular(choice.is_point) && choice.has_place
                                       ? 1 + v.equiangular_ratio(path.light_pivot(choice))
                                       : 1.f;
    const float weight = light->delta ? 1 / with_equiangular
                                      : light->pdf / (light->pdf * with_equiangular +
                                                      path.direction_pdf(p, phase.pdf, light->direction));
    float traced = 1;  // probability of tracing the shadow ray
    if constexpr (F.grids && !F.connected) {
      if (medium.grid && path.world_.faint_shadow > 0) {
        C3 most = path.beta_ * light->radiance * (phase.value * weight / light->pdf);
        if constexpr (F.chromatic) most /= path.mean(path.density_);
        traced = shadow_ray_probability(path.mean(most), path.world_.faint_shadow);
        if (!(g.u(3) < traced)) return;
      }
    }
    const C3 arriving = path.unoccluded(path.ray_.start, p, *light, path.medium_,
                                        path.stream_.stream(path.depth_, Purpose::track_shadow));
    if (!is_black(arriving))
      path.add_found(choice, p, V3(0), light->direction,
                     path.beta_ * arriving * (phase.value * weight / (light->pdf * traced)),
                     [&phase] { return phase.pdf; });
  }

 private:
  static bool points_only(const Medium& medium) {
    return F.grids && medium.equiangular_mode == EquiangularMode::points;
  }

  // Strategy (3): adds single-scattered light at a point of the segment that is sampled equi-angularly about
  // the light. Not inlined, to keep it out of the code for media that do not use it.
  template <class Path>
  [[gnu::noinline]] static void sample_equiangular(Path& path, const Medium& medium, Segment segment) {
    const Lights& lights = path.world_.lights;
    const Group g = path.stream_.group(path.segment_, Purpose::segment);
    const LightChoice choice =
        lights.choose_before_point({g.bits[0], g.bits[1], g.bits[2]}, path.place_on(segment));
    if (!choice.has_place || (points_only(medium) && !choice.is_point)) return;
    const OpticalDepthIn<F> depths(medium, path.ray_.start, path.ray_.d, segment.length);
    const float length = depths.to() - depths.from();
    if (!(length > 0)) return;
    const V3 o = path.ray_.start + path.ray_.d * depths.from();
    const EquiAngular::Sample s =
        EquiAngular(o, path.ray_.d, length, path.light_pivot(choice)).sample(g.u(3));
    const DepthPoint at_point = depths.at(depths.from() + s.t);
    const V3 p = path.ray_.moved_off_ends(s.p, segment, at_point.t);
    const C3 scattering = at_point.rate > 0 ? depths.scattering(at_point, p) : C3(0);
    if (is_black(scattering)) return;
    const auto light = path.sample_light(choice, p);
    if (!light || !(s.pdf > 0) || !path.turn_to(choice, medium)) return;
    const PhaseValue<F> phase = medium.phase_value<F>(p, path.ray_.d, light->direction);
    const float ratio = ratio_to_flight(s.pdf, flight_pdf<F>(medium, path.density_, at_point));
    const bool delta = light->delta;
    const float weight =
        delta ? ratio / (1 + ratio)
              : light->pdf /
                    (light->pdf + (light->pdf + path.direction_pdf(p, phase.pdf, light->direction)) / ratio);
    const C3 arriving = path.unoccluded(s.p, p, *light, path.medium_,
                                        path.stream_.stream(path.segment_, Purpose::track_segment));
    if (is_black(arriving)) return;
    const C3 through = transmittance<F>(medium, path.ray_.start, path.ray_.d, 0, at_point.t,
                                        path.stream_.stream(path.segment_, Purpose::track_distance));
    path.see(s.p);
    path.add(path.beta_ * (scattering * through) * arriving * (phase.value * weight / (light->pdf * s.pdf)),
             path.group_of(choice), true);
  }
};

}  // namespace ls::render
