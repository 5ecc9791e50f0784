// The default strategy of path.h for light in media: (1) next-event estimation at each vertex, and (3)
// next-event estimation at points placed equi-angularly about the light on each segment: in homogeneous media
// about every light with a place; in grids, on the part of a segment that has any density, about lights
// without an extent (docs/decisions/0011-equi-angular-points-in-grids.md).
// With (2), directions from the phase function that hit a light: for a vertex at distance t of a segment, (1)
// and (2) share the density f(t) of free flight and (3) has e(t); with p_l, p_s the solid-angle densities of
// light and direction sampling the weights are, up to their common sum, (1) f p_l, (2) f p_s, (3) e p_l. Only
// the ratio e / f matters: `focus` below. In grids f stands for the density of flights through the macro
// cells' means (stretch.h): weights need not know the true one, they need to be the same functions of the
// vertex for all strategies.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/built.h"
#include "worker/render/equiangular.h"
#include "worker/render/sampler.h"
#include "worker/render/segment.h"
#include "worker/render/stretch.h"
#include "worker/render/world.h"

namespace ls::render {

// Density of the free flight ending at this spot, whichever channel were the hero. `density`: of the path so
// far, by channel, relative to the hero's.
template <Features F>
float flight_pdf(const Medium& m, [[maybe_unused]] const C3& density, const Stretch::Spot& spot) {
  if constexpr (F.chromatic) {
    float num = 0;
    for (int c = 0; c < 3; ++c) num += density[c] * (m.sigma_t[c] * std::exp(-m.sigma_t[c] * spot.x));
    return spot.rate * (num / 3 / ((density.x + density.y + density.z) / 3));
  } else {
    const float s = m.sigma_t.x * std::exp(-m.sigma_t.x * spot.x);
    return spot.rate * ((s + s + s) / 3);
  }
}

// e / f, both of one spot. The means of macro cells may take f to 0 where flights still get to: then it is
// the largest ratio, for all strategies alike.
inline float ratio_to_flight(float e, float f) { return f > 0 ? std::min(e / f, kMaxRatio) : kMaxRatio; }

template <Features F>
class VertexLight {
 public:
  struct Plan {
    float length = 0;  // of a segment that is sampled equi-angularly, too; else 0

    bool matters() const { return kBuilt.equiangular && length > 0; }
  };
  struct Vertex {  // of such a segment: of the part that has a medium
    bool focused = false, points_only = false;
    V3 o{0, 0, 0}, d{0, 0, 0};
    float length = 0, t = 0, flight_pdf = 0;

    bool focuses(bool is_point) const {
      return kBuilt.equiangular && focused && (is_point || !(F.grids && points_only));
    }
    // e / f for a light with this pivot, where it focuses on such.
    float focus(const V3& pivot) const {
      return ratio_to_flight(EquiAngular(o, d, length, pivot).pdf(t), flight_pdf);
    }
    // Of a light that was hit: no point.
    float found_as_light(const V3& pivot) const { return focuses(false) ? 1 + focus(pivot) : 1.f; }
    static float found_as_light() { return 1; }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment) {
    if (!kBuilt.equiangular || medium.focus == Focus::none) return {};
    if (!path.may_scatter() || !(points_only(medium) || std::isfinite(segment.length))) return {};
    focus_on_light(path, medium, segment);
    return {segment.length};
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    Vertex v;
    const StretchIn<F> stretch(medium, path.start_, path.d_, plan.length);
    v.points_only = points_only(medium);
    v.o = path.start_ + path.d_ * stretch.from();
    v.d = path.d_;
    v.length = stretch.to() - stretch.from();
    v.t = t - stretch.from();
    const Stretch::Spot spot = stretch.at(t);
    v.flight_pdf = flight_pdf<F>(medium, path.density_, spot);
    // Also where that is 0 by underflow: points are placed there (focus_on_light).
    v.focused = spot.rate > 0 && v.length > 0;
    return v;
  }

  // Strategy (1); d is the direction of travel before the scattering.
  template <class Path>
  static void at_vertex(Path& path, const Medium& medium, const V3& p, const V3& d) {
    const Lights& lights = path.world_.lights;
    if (!lights.can_sample()) return;
    const Group g = path.stream_.group(path.depth_, Purpose::light);
    const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]}, p, V3(0));
    const auto light = lights.sample(choice, p);
    if (!light) return;
    const float phase = medium.phase.value(d, light->direction);
    const Vertex& v = path.last_.in_medium;
    const float with_focus =
        v.focuses(choice.is_point) && choice.has_place ? 1 + v.focus(lights.pivot(choice)) : 1.f;
    const float weight = !kBuilt.found_lights || light->delta
                             ? 1 / with_focus
                             : light->pdf / (light->pdf * with_focus + phase);
    const C3 arriving = path.unoccluded(path.start_, p, *light, path.medium_,
                                        path.stream_.stream(path.depth_, Purpose::track_shadow));
    if (!is_black(arriving)) path.add(path.beta_ * arriving * (phase * weight / light->pdf));
  }

 private:
  static bool points_only(const Medium& medium) { return F.grids && medium.focus == Focus::points; }

  // Strategy (3): light scattered once, from a vertex near the light. Out of the way of media without one.
  template <class Path>
  [[gnu::noinline]] static void focus_on_light(Path& path, const Medium& medium, Segment segment) {
    const Lights& lights = path.world_.lights;
    const Group g = path.stream_.group(path.segment_, Purpose::segment);
    const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]});
    if (!choice.has_place || (points_only(medium) && !choice.is_point)) return;
    const StretchIn<F> stretch(medium, path.start_, path.d_, segment.length);
    const float length = stretch.to() - stretch.from();
    if (!(length > 0)) return;
    const V3 o = path.start_ + path.d_ * stretch.from();
    const EquiAngular::Sample s = EquiAngular(o, path.d_, length, lights.pivot(choice)).sample(g.u(3));
    const Stretch::Spot spot = stretch.at(stretch.from() + s.t);
    const V3 p = path.clear_of_ends(s.p, segment, spot.t);
    const C3 scattering = spot.rate > 0 ? stretch.scattering(spot, p) : C3(0);
    if (is_black(scattering)) return;
    const auto light = lights.sample(choice, p);
    if (!light || !(s.pdf > 0)) return;
    const float phase = medium.phase.value(path.d_, light->direction);
    const float ratio = ratio_to_flight(s.pdf, flight_pdf<F>(medium, path.density_, spot));
    const bool delta = !kBuilt.found_lights || light->delta;
    const float weight =
        delta ? ratio / (1 + ratio) : light->pdf / (light->pdf + (light->pdf + phase) / ratio);
    const C3 arriving = path.unoccluded(s.p, p, *light, path.medium_,
                                        path.stream_.stream(path.segment_, Purpose::track_segment));
    if (is_black(arriving)) return;
    const C3 through = transmittance<F>(medium, path.start_, path.d_, 0, spot.t,
                                        path.stream_.stream(path.segment_, Purpose::track_distance));
    path.add(path.beta_ * (scattering * through) * arriving * (phase * weight / (light->pdf * s.pdf)), true);
  }
};

}  // namespace ls::render
