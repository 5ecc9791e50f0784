// Part of path.h, which includes it: where several media are in effect. Their particles don't know of each
// other: a flight ends at the first collision with any of them, and light gets through if it gets through
// each. The phase function at a vertex is that of the medium that was met: no mixture is needed.
#pragma once

#include <cmath>

#include "worker/render/glow.h"
#include "worker/render/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
std::optional<float> PathTracer<F, Light>::scatter_among(const SurfaceHit* end, float reach) {
  const float t_max = end ? way_to(*end, start_, o_, d_) : reach;
  const Segment segment{t_max, dot(o_ - start_, d_), end};
  if constexpr (F.emission) add_glow_among(t_max);
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
        free_flight<F>(m, hero_, bits, start_, d_, flight.t, RandomStream(streams.next()), counters_);
    if (!f.scattered) continue;
    flight = f;
    met = &m;
    winner = i;
  }
  for (std::size_t i = 0; i < media.size(); ++i)
    if (!met || i != winner) apply(passed(world_.media[media[i]], hero_, start_, d_, flight.t));
  if (!met) return std::nullopt;
  if (!may_scatter()) {
    beta_ = C3(0);
    return std::nullopt;
  }
  last_ = Vertex{};
  last_.delta = false;
  stand_at(segment, flight.t);
  apply(flight);
  if constexpr (F.split) first_in_medium_ = first_in_medium_ || depth_ == 0;
  ++depth_;
  light_vertex(*met, last_.p, d_);
  const Group direction = stream_.group(depth_, Purpose::direction);
  const PhaseSample s = met->phase.sample(d_, {direction.u(0), direction.u(1)});
  last_.pdf = s.pdf;
  d_ = s.w;
  return direction.u(3);
}

// Next-event estimation at a vertex, weighed against directions of the phase function alone.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::light_vertex(const Medium& medium, const V3& p, const V3& d) {
  const Lights& lights = world_.lights;
  if (!lights.can_sample()) return;
  const Group g = stream_.group(depth_, Purpose::light);
  const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]}, p, V3(0));
  const auto light = lights.sample(choice, p);
  if (!light) return;
  const float phase = medium.phase.value(d, light->direction);
  const float weight = light->delta ? 1 : light->pdf / (light->pdf + phase);
  const C3 arriving = unoccluded(start_, p, *light, medium_, stream_.stream(depth_, Purpose::track_shadow));
  if (!is_black(arriving)) add(beta_ * arriving * (phase * weight / light->pdf));
}

// What each medium gives off up to where a flight through the others ends: they let that flight pass with
// just the share of light that they let pass. Channels that fade differently have flights of their own, with
// the same numbers.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_glow_among(float t_max) {
  if (depth_ == 0 && world_.hide_emitters) return;
  RandomStream streams = stream_.stream(segment_, Purpose::overlap_emission);
  const auto media = medium_.all();
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::uint64_t key = streams.next();
    const Medium& m = world_.media[media[i]];
    if (m.glow == Glow::none) continue;
    C3 light(0);
    float last = -1;
    C3 up_to_last;
    for (int c = 0; c < 3; ++c) {
      const float t = others_end(i, c, t_max, RandomStream(key));
      if (t != last) {
        up_to_last = m.grid ? glow_of_grid(m, start_, d_, t, RandomStream(mix64(key))) : glow_of_length(m, t);
        last = t;
      }
      light[c] = up_to_last[c];
    }
    if (!is_black(light)) add(beta_ * light);
  }
}

template <Features F, template <Features> class Light>
float PathTracer<F, Light>::others_end(std::size_t but, int hero, float t_max, RandomStream streams) {
  const auto media = medium_.all();
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::uint32_t bits = streams.bits();
    const RandomStream stream(streams.next());
    if (i == but) continue;
    const Flight f = free_flight<F>(world_.media[media[i]], hero, bits, start_, d_, t_max, stream, counters_);
    if (f.scattered) t_max = f.t;
  }
  return t_max;
}

}  // namespace ls::render
