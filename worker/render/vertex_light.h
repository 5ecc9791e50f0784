// The default strategy of path.h for light in media: (1) next-event estimation at each vertex, and (3) in
// homogeneous media, next-event estimation at points placed equi-angularly about the light on each segment.
// With (2), directions from the phase function that hit a light: for a vertex at distance t of a segment, (1)
// and (2) share the density f(t) of free flight and (3) has e(t); with p_l, p_s the solid-angle densities of
// light and direction sampling the weights are, up to their common sum, (1) f p_l, (2) f p_s, (3) e p_l. Only
// the ratio e / f matters: `focus` below.
#pragma once

#include <cmath>

#include "worker/render/built.h"
#include "worker/render/equiangular.h"
#include "worker/render/sampler.h"
#include "worker/render/segment.h"
#include "worker/render/world.h"

namespace ls::render {

// Density of the free flight through a homogeneous medium ending at t, whichever channel were the hero.
// `density`: of the path so far, by channel, relative to the hero's.
template <Features F>
float flight_pdf(const Medium& m, [[maybe_unused]] const C3& density, float t) {
  if constexpr (F.chromatic) {
    float num = 0;
    for (int c = 0; c < 3; ++c) num += density[c] * (m.sigma_t[c] * std::exp(-m.sigma_t[c] * t));
    return num / 3 / ((density.x + density.y + density.z) / 3);
  } else {
    const float s = m.sigma_t.x * std::exp(-m.sigma_t.x * t);
    return (s + s + s) / 3;
  }
}

template <Features F>
class VertexLight {
 public:
  struct Plan {
    bool focused = false;  // sampled equi-angularly, too
    float length = 0;
  };
  struct Vertex {  // of a focused segment:
    bool focused = false;
    V3 o{0, 0, 0}, d{0, 0, 0};
    float length = 0, t = 0, flight_pdf = 0;

    // e / f for a light with this pivot.
    float focus(const V3& pivot) const {
      return focused ? EquiAngular(o, d, length, pivot).pdf(t) / flight_pdf : 0.f;
    }
    float found_as_light(const V3& pivot) const { return 1 + focus(pivot); }
    static float found_as_light() { return 1; }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, const Segment& segment, bool may_scatter) {
    const bool focused = kBuilt.equiangular && path.world_.equiangular && !medium.grid &&
                         std::isfinite(segment.length) && may_scatter;
    if (focused) focus_on_light(path, medium, segment.length);
    return {focused, segment.length};
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    Vertex v;
    if (!plan.focused) return v;
    v.o = path.start_;
    v.d = path.d_;
    v.length = plan.length;
    v.t = t;
    v.flight_pdf = flight_pdf<F>(medium, path.density_, t);
    v.focused = v.flight_pdf > 0;
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
    const float with_focus = 1 + (choice.has_place ? path.last_.in_medium.focus(choice.pivot) : 0.f);
    const float weight = light->delta ? 1 / with_focus : light->pdf / (light->pdf * with_focus + phase);
    const C3 arriving =
        path.unoccluded(p, p, *light, path.medium_, path.stream_.stream(path.depth_, Purpose::track_shadow));
    if (!is_black(arriving)) path.add(path.beta_ * arriving * (phase * weight / light->pdf));
  }

 private:
  // Strategy (3): light scattered once, from a vertex near the light.
  template <class Path>
  static void focus_on_light(Path& path, const Medium& medium, float t_max) {
    const Lights& lights = path.world_.lights;
    const Group g = path.stream_.group(path.segment_, Purpose::segment);
    const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]});
    if (!choice.has_place || !(t_max > 0)) return;
    const EquiAngular::Sample s = EquiAngular(path.start_, path.d_, t_max, choice.pivot).sample(g.u(3));
    const auto light = lights.sample(choice, s.p);
    if (!light || !(s.pdf > 0)) return;
    const float phase = medium.phase.value(path.d_, light->direction);
    // e / f; infinite where no flight gets to
    const float ratio = s.pdf / flight_pdf<F>(medium, path.density_, s.t);
    const float share = light->delta ? 1 : light->pdf / (light->pdf + (light->pdf + phase) / ratio);
    const float weight = light->delta ? (std::isfinite(ratio) ? ratio / (1 + ratio) : 1.f)
                                      : (std::isfinite(ratio) ? share : 1.f);
    const C3 arriving = path.unoccluded(s.p, s.p, *light, path.medium_,
                                        path.stream_.stream(path.segment_, Purpose::track_segment));
    if (is_black(arriving)) return;
    C3 in_scattered;
    for (int c = 0; c < 3; ++c) in_scattered[c] = medium.sigma_s[c] * std::exp(-medium.sigma_t[c] * s.t);
    path.add(path.beta_ * in_scattered * arriving * (phase * weight / (light->pdf * s.pdf)), true);
  }
};

}  // namespace ls::render
