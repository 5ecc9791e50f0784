// The integrator `volpath_distant_mis` as a strategy of path_tracer.h: single scattering on a segment through
// a medium is estimated by next-event estimation at points that are sampled for this purpose. The vertices at
// which the path's own flights end do no next-event estimation.
//
// There are two densities for points. (D) depth: a truncated exponential; in grids it uses the mean densities
// of the macro cells (optical_depth.h) and is mixed with a uniform density. (A) angle: equi-angular about the
// light. Some points are sampled with (D), others with (A). Their MIS weights are computed by
// World::heuristic from e_D and e_A, the densities of (D) and (A). (A) requires a light with a position and a
// finite segment; otherwise (D) is used alone.
//
// Phase-function sampling that hits a light is a third strategy. With f(t) the density of flights (in grids
// that of the macro cells' means) and p_l, p_s the solid-angle densities of light and phase sampling,
// next-event estimation gets the weight e p_l / (e p_l + f p_s), where e is the sum of the densities used. In
// place of e and f any functions of the path alone would give unbiased results; closer approximations of the
// densities give less variance. Channels are combined as in path_tracer.h: each density is the mean over the
// three choices of the hero, the channel that decides distances.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "worker/render/integrator/equiangular.h"
#include "worker/render/integrator/mis.h"
#include "worker/render/integrator/offset_ray.h"
#include "worker/render/integrator/vertex_nee.h"
#include "worker/render/math/random.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/optical_depth.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The exponential density sigma e^(-sigma x) truncated to [0, length], written with expm1 and log1p so that
// it is accurate for optical depths sigma * length from 1e-20, where it is uniform, to 1e6. The textbook form
// divides by 1 - exp(-sigma length), which is 0 in float32 for all depths below 6e-8.
//
// For optical depths below kThinDepth the density is uniform to the last bit. kThinDepth is large enough that
// products with it do not underflow.
inline constexpr float kThinDepth = 1e-20f;

// The density at x. Requires sigma >= 0, length > 0 (may be infinite) and x in [0, length]. Returns 0 if
// sigma is 0 and length infinite: then there is no density.
inline float truncated_pdf(float sigma, float length, float x) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return 1 / length;
  return sigma * std::exp(-sigma * x) / -std::expm1(-depth);
}

// Samples x with the density truncated_pdf() from v, a uniform random number in (0, 1). The result is not
// finite if no such density exists.
inline float truncated_sample(float sigma, float length, double v) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return static_cast<float>(v) * length;
  const double through = std::exp(-double{depth}), rest = -std::expm1(-double{depth});
  const float x = minus_log(static_cast<float>((1 - v) + v * through), static_cast<float>(v * rest));
  return std::min(x / sigma, length);
}

// The truncated exponential mixed with a uniform density. It is used for grids, where the mean density of the
// cells may be far above the density along the ray. kEvenShare is the probability of the uniform part, in
// units of 2^-32.
inline constexpr std::uint32_t kEvenShare = 429496730;  // a tenth

inline float mixed_depth_pdf(float sigma, float length, float x) {
  constexpr float kEven = static_cast<float>(kEvenShare) * 0x1p-32f;
  return (1 - kEven) * truncated_pdf(sigma, length, x) + kEven / length;
}
inline float mixed_depth_sample(float sigma, float length, std::uint32_t bits) {
  if (bits < kEvenShare) return static_cast<float>((bits + .5) / kEvenShare * length);
  return truncated_sample(sigma, length, (bits - kEvenShare + .5) / (0x1p32 - kEvenShare));
}

template <Features F>
class SegmentNee {
 public:
  struct Plan {
    OpticalDepthIn<F> depths;
    int by_depth = 1;     // number of points sampled by depth
    bool angles = false;  // true if the segment is finite, so that points can be sampled by angle

    static bool matters() { return true; }
  };
  // The data about a path's vertex. A vertex that is not in a medium has the default values.
  struct Vertex {
    bool by_depth = true, by_angle = false;
    float depth_ratio = 1;  // the ratio e_D / f at this vertex
    float flight_pdf = 0, t = 0;
    V3 o{0, 0, 0}, d{0, 0, 0};
    float length = 0;
    float points = 1;  // number of points that were sampled by depth on the segment that ends at the vertex

    // True would mean that the vertex's light was chosen by Lights::choose_before_point(). That is so for
    // vertices in media, but not for those on surfaces, which this type describes too. Returning false is
    // correct for both: in media the probability of a light is the same either way, since this strategy never
    // uses the light tree there (Lights::use_tree_in_media).
    static bool light_chosen_first() { return false; }
    float found_as_light() const { return std::min(points * depth_ratio, kMaxRatio); }
    float found_as_light(const Pivot& pivot) const {
      if (!by_angle) return found_as_light();
      const float ratio = flight_pdf > 0 ? angle_pdf(pivot) / flight_pdf : kMaxRatio;
      return std::min(by_depth ? points * depth_ratio + ratio : ratio, kMaxRatio);
    }
    float angle_pdf(const Pivot& pivot) const { return EquiAngular(o, d, length, pivot).pdf(t); }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment, int points = 1) {
    Plan plan{OpticalDepthIn<F>(medium, path.ray_.start, path.ray_.d, segment.length), points};
    const OpticalDepthIn<F>& s = plan.depths;
    plan.angles =
        path.world_.distance != DistanceSampling::exponential && std::isfinite(s.to()) && s.to() > s.from();
    const Lights& lights = path.world_.lights;
    if (!path.may_scatter() || !lights.can_sample() || !(s.total() > 0)) return plan;
    if (path.world_.distance == DistanceSampling::mis || !plan.angles) {
      RandomStream stream = path.stream_.stream(path.segment_, Purpose::track_distance);
      const Group g = path.stream_.group(path.segment_, Purpose::distance);
      for (int i = 0; i < points; ++i) {
        const Group at = point_of(g, i, points);
        const LightChoice choice =
            lights.choose_before_point({at.bits[0], at.bits[1], at.bits[2]}, path.place_on(segment));
        propose(path, medium, segment, plan, choice, false, at.bits[3], stream);
      }
    }
    if (plan.angles) {
      RandomStream stream = path.stream_.stream(path.segment_, Purpose::track_segment);
      const Group g = path.stream_.group(path.segment_, Purpose::segment);
      const LightChoice choice =
          lights.choose_before_point({g.bits[0], g.bits[1], g.bits[2]}, path.place_on(segment));
      if (choice.has_place || path.world_.distance == DistanceSampling::equiangular)
        propose(path, medium, segment, plan, choice, choice.has_place, g.bits[3], stream);
    }
    return plan;
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    return vertex_at(path, medium, plan, plan.depths.at(t));
  }

  template <class Path>
  // Adds no light, because ahead() has already added all light scattered on the segment
  static void at_vertex(Path&, const Medium&, const V3&, const V3&) {}

 private:
  // Returns the random numbers of point i out of `points` points. `g` has the numbers that a single point
  // would use. Positions are stratified along the segment. The numbers that choose a light, and a point on
  // it, advance by constant steps, modulo 1.
  static Group point_of(const Group& g, int i, int points) {
    if (points == 1) return g;
    const auto k = static_cast<std::uint32_t>(i), n = static_cast<std::uint32_t>(points);
    const std::uint32_t step = static_cast<std::uint32_t>((std::uint64_t{1} << 32) / n);
    const std::uint64_t place = ((std::uint64_t{k} << 32) + g.bits[3]) / n;
    // With these steps the points on the light form a two-dimensional lattice (Roberts 2018, R2).
    return {{g.bits[0] + k * step, g.bits[1] + k * 0xc13fa9a9u, g.bits[2] + k * 0x91e10da5u,
             static_cast<std::uint32_t>(place)}};
  }

  // The mean over channels of density(sigma), where sigma is the channel's extinction. Each channel is
  // weighted by the density of the path so far if that channel were the hero, relative to that of the actual
  // hero.
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

  // The density of strategy (D) at x, per unit of x. x is the density of the medium integrated along the ray
  // (optical_depth.h).
  template <class Path>
  static float depth_pdf(const Path& path, const Medium& medium, const Plan& plan, float x) {
    const float total = plan.depths.total();
    return over_channels(path, medium, [&](float sigma) {
      return F.grids && medium.grid ? mixed_depth_pdf(sigma, total, x) : truncated_pdf(sigma, total, x);
    });
  }
  static float depth_sample(const Medium& medium, const Plan& plan, int hero, std::uint32_t bits) {
    const float total = plan.depths.total();
    if (!(F.grids && medium.grid))
      return truncated_sample(medium.sigma_t[hero], total, (bits + .5) * 0x1p-32);
    return mixed_depth_sample(medium.sigma_t[hero], total, bits);
  }

  template <class Path>
  static Vertex vertex_at(const Path& path, const Medium& medium, const Plan& plan,
                          const DepthPoint& at_point) {
    const float flight =
        over_channels(path, medium, [&](float sigma) { return sigma * std::exp(-sigma * at_point.x); });
    const DistanceSampling distance = path.world_.distance;
    Vertex v;
    v.points = static_cast<float>(plan.by_depth);
    v.by_angle = plan.angles;
    v.by_depth = distance != DistanceSampling::equiangular || !plan.angles;
    v.depth_ratio =
        flight > 0 ? std::min(depth_pdf(path, medium, plan, at_point.x) / flight, kMaxRatio) : kMaxRatio;
    v.flight_pdf = at_point.rate * flight;
    v.t = at_point.t - plan.depths.from();
    v.o = path.ray_.start + path.ray_.d * plan.depths.from();
    v.d = path.ray_.d;
    v.length = plan.depths.to() - plan.depths.from();
    return v;
  }

  // Samples one point of the segment, by angle or by depth, and adds the light that is scattered there
  // towards the path.
  template <class Path>
  static void propose(Path& path, const Medium& medium, const Segment& segment, const Plan& plan,
                      const LightChoice& choice, bool by_angle, std::uint32_t bits, RandomStream& stream) {
    const OpticalDepthIn<F>& s = plan.depths;
    const Pivot pivot = choice.has_place ? path.light_pivot(choice) : Pivot(V3(0));
    DepthPoint at_point;
    V3 p;
    float e_angle = 0;
    if (by_angle) {
      const V3 o = path.ray_.start + path.ray_.d * s.from();
      const auto a = EquiAngular(o, path.ray_.d, s.to() - s.from(), pivot).sample(unit_float(bits));
      at_point = s.at(s.from() + a.t);
      p = a.p;
      e_angle = a.pdf;
    } else {
      const float x = depth_sample(medium, plan, path.hero_, bits);
      if (!std::isfinite(x)) return;  // not finite if the hero has no extinction and the medium has no end
      at_point = s.after(x);
      p = path.ray_.start + path.ray_.d * at_point.t;
    }
    const V3 start = p;
    p = path.ray_.moved_off_ends(p, segment, at_point.t);
    const C3 scattering = at_point.rate > 0 ? s.scattering(at_point, p) : C3(0);
    if (is_black(scattering)) return;
    const auto light = path.sample_light(choice, p);
    if (!light || !path.turn_to(choice, medium)) return;

    const Vertex v = vertex_at(path, medium, plan, at_point);
    const bool both = choice.has_place && v.by_angle && v.by_depth;
    const float e_depth = at_point.rate * depth_pdf(path, medium, plan, at_point.x);
    if (both && !by_angle) e_angle = v.angle_pdf(pivot);
    // The expected numbers of points per unit length at this point: `by_depth` counts all points sampled by
    // depth, `own` those sampled by the strategy that sampled this point.
    const float by_depth = e_depth * v.points;
    const float own = by_angle ? e_angle : by_depth;
    if (!(own > 0)) return;
    float weight = both ? mis_weight(path.world_.heuristic, own, by_angle ? by_depth : e_angle) : 1.f;
    const PhaseValue<F> phase = medium.phase_value<F>(p, path.ray_.d, light->direction);
    if (!light->delta) {
      const float found = choice.has_place ? v.found_as_light(pivot) : v.found_as_light();
      weight *= 1 / (1 + path.direction_pdf(p, phase.pdf, light->direction) / (light->pdf * found));
    }
    const C3 arriving = path.unoccluded(start, p, *light, path.medium_, RandomStream(stream.next()));
    if (is_black(arriving)) return;
    const C3 through =
        transmittance<F>(medium, path.ray_.start, path.ray_.d, 0, at_point.t, RandomStream(stream.next()));
    path.see(start);
    path.add(path.beta_ * scattering * through * arriving * (phase.value * weight / (light->pdf * own)),
             path.group_of(choice), true);
  }
};

// The strategy with Features::aimed. On segments that start at the camera or at a delta lobe (mirror, smooth
// glass), light scattered on the segment is estimated at several points of the segment, as by SegmentNee,
// instead of at the vertex where the free flight ends. On all other segments the default strategy is used
// (vertex_nee.h).
//
// In a thin medium few flights end on the camera's segment, and the few that do carry all of its scattered
// light: this is most of the noise of light shafts. Points on the segment exist in every sample, and share
// the cost of the camera ray.
template <Features F>
class CameraSegmentNee {
  using Points = SegmentNee<F>;
  using Single = VertexNee<F>;

 public:
  struct Plan {
    std::optional<typename Points::Plan> points;  // nullopt if the default strategy is used
    typename Single::Plan single;

    bool matters() const { return points || single.matters(); }
  };
  struct Vertex {
    bool by_points = false;
    typename Points::Vertex points;
    typename Single::Vertex single;

    float found_as_light() const { return by_points ? points.found_as_light() : single.found_as_light(); }
    float found_as_light(const Pivot& pivot) const {
      return by_points ? points.found_as_light(pivot) : single.found_as_light(pivot);
    }
    bool light_chosen_first() const { return by_points; }
    bool uses_equiangular(bool is_point) const { return single.uses_equiangular(is_point); }
    float equiangular_ratio(const Pivot& pivot) const { return single.equiangular_ratio(pivot); }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment) {
    if (path.last_.delta && path.world_.camera_points > 0)
      return {Points::ahead(path, medium, segment, path.world_.camera_points), {}};
    return {std::nullopt, Single::ahead(path, medium, segment)};
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    if (plan.points) return {true, Points::vertex(path, medium, *plan.points, t), {}};
    return {false, {}, Single::vertex(path, medium, plan.single, t)};
  }

  template <class Path>
  static void at_vertex(Path& path, const Medium& medium, const V3& p, const V3& d) {
    if (!path.last_.in_medium.by_points) Single::at_vertex(path, medium, p, d);
  }
};

}  // namespace ls::render
