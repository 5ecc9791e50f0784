// The integrator `volpath_distant_mis` as a strategy of path.h: on every segment through a medium, light that
// is scattered once somewhere on it is found by next-event estimation from points that are proposed for it,
// not from the vertices where the path's own flights happen to end. These go on without it.
//
// Points are proposed by (D) depth: the truncated exponential, in grids that of the macro cells' means (see
// stretch.h) with a uniform share; and by (A) angle: equi-angularly about the light. Each makes a point of
// its own; `heuristic` weighs their densities e_D and e_A against each other. About a light without a place,
// and on a segment without an end, there are no angles: then (D) is used alone.
//
// Directions that the phase function chose and that hit a light are a third way to the same light. With f(t)
// the density of flights (in grids that of the macro cells' means) and p_l, p_s the solid-angle densities of
// light and phase sampling, next-event estimation has the share e p_l / (e p_l + f p_s), e being the sum of
// the densities that were used: any functions of the path alone would do, the closer the better. Channels are
// combined as in path.h: densities are means over what each channel would have done as the hero.
#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/equiangular.h"
#include "worker/render/mis.h"
#include "worker/render/sampler.h"
#include "worker/render/segment.h"
#include "worker/render/stretch.h"
#include "worker/render/truncated.h"
#include "worker/render/world.h"

namespace ls::render {

template <Features F>
class SegmentLight {
 public:
  struct Plan {
    StretchIn<F> stretch;
    bool angles = false;  // the stretch has an end to propose points by angle

    static bool matters() { return true; }
  };
  struct Vertex {  // default-constructed: not in a medium
    bool by_depth = true, by_angle = false;
    float depth_ratio = 1;  // e_D / f
    float flight_pdf = 0, t = 0;
    V3 o{0, 0, 0}, d{0, 0, 0};
    float length = 0;

    float found_as_light() const { return depth_ratio; }
    float found_as_light(const V3& pivot) const {
      if (!by_angle) return depth_ratio;
      const float ratio = flight_pdf > 0 ? angle_pdf(pivot) / flight_pdf : kMaxRatio;
      return std::min(by_depth ? depth_ratio + ratio : ratio, kMaxRatio);
    }
    float angle_pdf(const V3& pivot) const { return EquiAngular(o, d, length, pivot).pdf(t); }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment) {
    Plan plan{StretchIn<F>(medium, path.start_, path.d_, segment.length)};
    const StretchIn<F>& s = plan.stretch;
    plan.angles =
        path.world_.distance != DistanceSampling::exponential && std::isfinite(s.to()) && s.to() > s.from();
    const Lights& lights = path.world_.lights;
    if (!path.may_scatter() || !lights.can_sample() || !(s.total() > 0)) return plan;
    if (path.world_.distance == DistanceSampling::mis || !plan.angles) {
      const Group g = path.stream_.group(path.segment_, Purpose::distance);
      const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]});
      propose(path, medium, segment, plan, choice, false, g.bits[3]);
    }
    if (plan.angles) {
      const Group g = path.stream_.group(path.segment_, Purpose::segment);
      const LightChoice choice = lights.choose({g.bits[0], g.bits[1], g.bits[2]});
      if (choice.has_place || path.world_.distance == DistanceSampling::equiangular)
        propose(path, medium, segment, plan, choice, choice.has_place, g.bits[3]);
    }
    return plan;
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    return vertex_at(path, medium, plan, plan.stretch.at(t));
  }

  template <class Path>
  static void at_vertex(Path&, const Medium&, const V3&, const V3&) {}  // all done ahead

 private:
  // The mean over channels, weighted by the densities of the path so far.
  template <class Path, class Fn>
  static float over_channels(const Path& path, const Medium& medium, Fn density) {
    if constexpr (F.chromatic) {
      float sum = 0;
      for (int c = 0; c < 3; ++c) sum += path.density_[c] * density(medium.sigma_t[c]);
      return sum / 3 / Path::mean(path.density_);
    } else {
      const float e = density(medium.sigma_t.x);
      return (e + e + e) / 3;
    }
  }

  // Of (D), per unit of x.
  template <class Path>
  static float depth_pdf(const Path& path, const Medium& medium, const Plan& plan, float x) {
    const float total = plan.stretch.total();
    return over_channels(path, medium, [&](float sigma) {
      return F.grids && medium.grid ? mixed_depth_pdf(sigma, total, x) : truncated_pdf(sigma, total, x);
    });
  }
  static float depth_sample(const Medium& medium, const Plan& plan, int hero, std::uint32_t bits) {
    const float total = plan.stretch.total();
    if (!(F.grids && medium.grid))
      return truncated_sample(medium.sigma_t[hero], total, (bits + .5) * 0x1p-32);
    return mixed_depth_sample(medium.sigma_t[hero], total, bits);
  }

  template <class Path>
  static Vertex vertex_at(const Path& path, const Medium& medium, const Plan& plan,
                          const Stretch::Spot& spot) {
    const float flight =
        over_channels(path, medium, [&](float sigma) { return sigma * std::exp(-sigma * spot.x); });
    const DistanceSampling distance = path.world_.distance;
    Vertex v;
    v.by_angle = plan.angles;
    v.by_depth = distance != DistanceSampling::equiangular || !plan.angles;
    v.depth_ratio =
        flight > 0 ? std::min(depth_pdf(path, medium, plan, spot.x) / flight, kMaxRatio) : kMaxRatio;
    v.flight_pdf = spot.rate * flight;
    v.t = spot.t - plan.stretch.from();
    v.o = path.start_ + path.d_ * plan.stretch.from();
    v.d = path.d_;
    v.length = plan.stretch.to() - plan.stretch.from();
    return v;
  }

  // Light scattered once, from one point.
  template <class Path>
  static void propose(Path& path, const Medium& medium, const Segment& segment, const Plan& plan,
                      const LightChoice& choice, bool by_angle, std::uint32_t bits) {
    const StretchIn<F>& s = plan.stretch;
    const V3 pivot = choice.has_place ? path.world_.lights.pivot(choice) : V3(0);
    Stretch::Spot spot;
    V3 p;
    float e_angle = 0;
    if (by_angle) {
      const V3 o = path.start_ + path.d_ * s.from();
      const auto a = EquiAngular(o, path.d_, s.to() - s.from(), pivot).sample(unit_float(bits));
      spot = s.at(s.from() + a.t);
      p = a.p;
      e_angle = a.pdf;
    } else {
      const float x = depth_sample(medium, plan, path.hero_, bits);
      if (!std::isfinite(x)) return;  // a hero that nothing dims, in a medium without end
      spot = s.after(x);
      p = path.start_ + path.d_ * spot.t;
    }
    const V3 start = p;
    p = path.clear_of_ends(p, segment, spot.t);
    const C3 scattering = spot.rate > 0 ? s.scattering(spot, p) : C3(0);
    if (is_black(scattering)) return;
    const auto light = path.world_.lights.sample(choice, p);
    if (!light) return;

    const Vertex v = vertex_at(path, medium, plan, spot);
    const bool both = choice.has_place && v.by_angle && v.by_depth;
    const float e_depth = spot.rate * depth_pdf(path, medium, plan, spot.x);
    if (both && !by_angle) e_angle = v.angle_pdf(pivot);
    const float own = by_angle ? e_angle : e_depth;
    if (!(own > 0)) return;
    float weight = both ? mis_weight(path.world_.heuristic, own, by_angle ? e_depth : e_angle) : 1.f;
    const float phase = medium.phase.value(path.d_, light->direction);
    if (!light->delta) {
      const float found = choice.has_place ? v.found_as_light(pivot) : v.found_as_light();
      weight *= 1 / (1 + phase / (light->pdf * found));
    }
    RandomStream stream =
        path.stream_.stream(path.segment_, by_angle ? Purpose::track_segment : Purpose::track_distance);
    const C3 arriving = path.unoccluded(start, p, *light, path.medium_, RandomStream(stream.next()));
    if (is_black(arriving)) return;
    const C3 through = transmittance<F>(medium, path.start_, path.d_, 0, spot.t, RandomStream(stream.next()));
    path.add(path.beta_ * scattering * through * arriving * (phase * weight / (light->pdf * own)), true);
  }
};

}  // namespace ls::render
