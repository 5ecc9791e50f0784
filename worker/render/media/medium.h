// Participating media: free flight and transmittance. In homogeneous media and in fog that falls with height
// (height_fog.h) both have a closed form. Grids use delta tracking with local majorants, and residual ratio
// tracking (Novak et al. 2014) with one control value per macro cell.
//
// Chromatic extinction: one channel, the hero, drawn once per path, decides every distance. A flight returns
// the path weight relative to the hero (`weight`), and for each channel the density of the sampled flight
// relative to the hero's (`density`). Dividing by the mean over channels of the accumulated densities is the
// balance heuristic over channels (Miller, Georgiev, Jarosz 2019). With equal channels every ratio is exactly
// 1, so achromatic code may omit them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "worker/render/base/features.h"
#include "worker/render/base/light_group.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/geometry/clear_region.h"
#include "worker/render/math/math.h"
#include "worker/render/math/random.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/grid.h"
#include "worker/render/media/height_fog.h"
#include "worker/render/media/phase.h"
#include "worker/render/media/phase_function.h"

namespace ls::render {

// The quantity to which the emission of a medium is proportional: length or absorption. For black_body it is
// proportional to absorption, and the factor is the radiance of a black body.
enum class EmissionKind : std::uint8_t { none, per_length, per_absorption, black_body };

// The lights about which segments through a medium are also sampled equi-angularly (vertex_nee.h): none,
// point lights, or all lights with a position.
enum class EquiangularMode : std::uint8_t { none, points, places };

// The phase function at a place for two directions [1/sr], and the density with which sampling finds the
// second direction. Without Features::phases the two are the same.
template <class T>
struct PhaseValueOf {
  using Colour = T;
  Colour value;
  float pdf;
};
template <Features F>
using PhaseValue = PhaseValueOf<std::conditional_t<F.phases, C3, float>>;

struct Medium {
  bool grid = false;
  EquiangularMode equiangular_mode = EquiangularMode::none;
  // For a homogeneous medium: the extinction and scattering coefficients [1/world unit]. For a grid: sigma_t
  // is the extinction per unit of density, and sigma_s is the albedo times sigma_t; so too if `height` is
  // set.
  C3 sigma_t{0, 0, 0}, sigma_s{0, 0, 0};
  const Grid* density = nullptr;
  // Set, in a medium that is not a grid, if its density falls with height. Only code with Features::height
  // sees it; all coefficients are those at the ground.
  std::optional<HeightProfile> height;
  // Set if the density differs between channels: one density grid per channel, all of the same shape and with
  // macro cells of the same size. Then `density` is the mean of the three. It determines where points on a
  // ray are sampled for next-event estimation (optical_depth.h); free flights and transmittance use the three
  // grids. sigma_t is the same for all channels.
  std::array<const Grid*, 3> by_channel{};
  std::array<const Grid*, 3> albedo{};  // null: the albedo is constant and already in sigma_s
  // For a grid with constant albedo, this is 1 - albedo, the share of extinction that is absorption. It is
  // stored separately because 1 - (1 - 1e-7) in float32 is off by a fifth.
  C3 absorbing{1, 1, 1};
  HenyeyGreenstein phase;
  // Set if the phase function is none of Henyey-Greenstein's: then it is number `other_phase` of these, and
  // `phase` is a rough idea of it, with the same mean cosine. Only code with Features::phases sees it.
  const PhaseFunctions* other_phases = nullptr;
  std::uint32_t other_phase = 0;
  // The emission (emission.h). A homogeneous medium emits `emission` [radiance per world unit]. A grid emits
  // `emission` times the value of the grid `emitter`; for black_body, `emission` times the radiance of a
  // black body at kelvin_offset + kelvin_scale times that value [K]. Unless the kind is per_length, the
  // emission is also multiplied by the absorption coefficient.
  EmissionKind emission_kind = EmissionKind::none;
  C3 emission{0, 0, 0};
  std::array<const Grid*, 3> emitter{};  // null: the value is 1 everywhere
  float kelvin_scale = 1, kelvin_offset = 0;
  bool peak_one = false;         // for black_body: spectra are divided by their peak
  const Grid* weight = nullptr;  // for black_body: a factor on the emission, 0 outside of this grid
  // The region inside the medium in which no surface lies; null if unknown. It is set only if flights may be
  // sampled before their rays are traced: if the medium does not emit, and light in it is sampled at vertices
  // alone.
  const ClearRegion* clear = nullptr;
  LightGroup light_group = kNoLightGroup;  // of the emission
  int priority = 0;  // where media overlap, only those of the highest priority are in effect
  bool chromatic() const { return sigma_t.x != sigma_t.y || sigma_t.y != sigma_t.z || by_channel[0]; }

  // Returns the phase function at the world point p, for the directions of travel w before and w1 after.
  template <Features F>
  PhaseValue<F> phase_value(const V3& p, const V3& w, const V3& w1) const {
    if constexpr (F.phases) {
      if (other_phases) {
        const PhaseFunctions::Value v = other_phases->value(other_phase, p, w, w1);
        return {v.value, v.pdf};
      }
    }
    const float same = phase.value(w, w1);
    return {typename PhaseValue<F>::Colour(same), same};
  }
  // Samples the direction after a scattering at p. With F.phases, multiplies `weight` by the phase function
  // over the density: 1, unless its colours differ.
  template <Features F>
  PhaseSample sample_phase([[maybe_unused]] const V3& p, const V3& w, V2 u,
                           [[maybe_unused]] C3& weight) const {
    if constexpr (F.phases) {
      if (other_phases) {
        const PhaseFunctions::Sample s = other_phases->sample(other_phase, p, w, u);
        weight *= s.of.pdf > 0 ? s.of.value / s.of.pdf : C3(0);
        return {s.w, s.of.pdf};
      }
    }
    return phase.sample(w, u);
  }

  // Returns the scattering coefficients per unit of density at the world point p of a grid.
  C3 scattering_at(const V3& p) const {
    if (!albedo[0]) return sigma_s;
    C3 s;
    for (int k = 0; k < 3; ++k) {
      const V3 q = albedo[k]->to_index(p);
      s[k] = sigma_t[k] * std::min(1.f, albedo[k]->value_anywhere(q));
    }
    return s;
  }
  // Returns the single-scattering albedo at the world point p; 0 in a channel without extinction.
  C3 albedo_at(const V3& p) const {
    const C3 s = grid ? scattering_at(p) : sigma_s;
    C3 a(0);
    for (int k = 0; k < 3; ++k)
      if (sigma_t[k] > 0) a[k] = s[k] / sigma_t[k];
    return a;
  }
};

struct Flight {
  bool scattered = false;
  float t = 0;
  C3 weight{1, 1, 1};
  // For each channel, the density of the flight relative to that of the hero. Only chromatic code uses it.
  C3 density{1, 1, 1};
};

// Counts densities that exceed the bound of their macro cell. Such a density biases the result, and nothing
// else would reveal it.
struct MediumCounters {
  std::uint64_t majorant_violations = 0;
};

// free_flight() and transmittance() call these functions for media with one density grid per channel
// (Medium::by_channel). Only chromatic code uses them. They are defined in medium.cpp.
Flight fly_channels(const Medium& m, int hero, float depth, const V3& o, const V3& d, float t_max,
                    RandomStream stream, MediumCounters& counters);
C3 transmittance_channels(const Medium& m, const V3& o, const V3& d, float t0, float t1, RandomStream stream);
// Returns the densities of the three channels of such a medium at index coordinates inside the grids' domain.
C3 densities(const Medium& m, const V3& index);

namespace detail {

// Returns the transmittance of channel c over that of the hero along `length`. It is one exponential of the
// difference, because a quotient of two exponentials could be 0 / 0; exactly 1 if the extinctions are equal.
inline float transmittance_ratio(float sigma_c, float sigma_hero, float length) {
  const float diff = sigma_c - sigma_hero;
  return diff == 0 ? 1.f : std::exp(-diff * length);
}

// Sets the weight and the densities of a flight whose end is set. depth() returns the integral of the density
// along the flight, where the coefficients are those at the density 1.
template <bool kChromatic, class Depth>
void weigh(Flight& f, const Medium& m, int hero, const Depth& depth) {
  const float s = m.sigma_t[hero];
  if constexpr (kChromatic) {
    const float length = depth();
    for (int c = 0; c < 3; ++c) f.weight[c] = f.density[c] = transmittance_ratio(m.sigma_t[c], s, length);
    if (f.scattered) {
      for (int c = 0; c < 3; ++c) {
        f.weight[c] = f.weight[c] * m.sigma_s[c] / s;
        f.density[c] = f.density[c] * m.sigma_t[c] / s;
      }
    }
  } else if (f.scattered) {
    for (int c = 0; c < 3; ++c) f.weight[c] = m.sigma_s[c] / s;
  }
}

template <bool kChromatic>
Flight fly_homogeneous(const Medium& m, int hero, float depth, float t_max) {
  Flight f;
  const float s = m.sigma_t[hero];
  f.t = s > 0 ? depth / s : kInfinity;
  f.scattered = f.t < t_max;
  weigh<kChromatic>(f, m, hero, [&] { return f.scattered ? f.t : t_max; });
  return f;
}

template <bool kChromatic>
Flight fly_height(const Medium& m, int hero, float depth, const V3& o, const V3& d, float t_max) {
  const HeightRay ray(*m.height, o, d);
  Flight f;
  const float s = m.sigma_t[hero], x = s > 0 ? depth / s : kInfinity;
  f.t = s > 0 ? static_cast<float>(ray.distance(x)) : kInfinity;
  f.scattered = f.t < t_max;
  if (!f.scattered) f.t = t_max;
  weigh<kChromatic>(f, m, hero, [&] { return f.scattered ? x : static_cast<float>(ray.depth(t_max)); });
  return f;
}

// If a tracker would expect more tentative collisions than this in a macro cell, the field is integrated
// exactly through the cell's voxels instead. A cell of 4 voxels costs about as much as 16 collisions, and no
// tracker gets stuck in it however dense it is (1e9 collisions and more: docs/measurements/stability.md N10).
inline constexpr float kExactDepth = 16;
// The same for fields that are computed at each lookup, whose integrals take hundreds of lookups.
inline constexpr float kExactFieldDepth = 512;
template <Lookup kLookup>
inline constexpr float kExactDepthOf = kLookup == Lookup::field ? kExactFieldDepth : kExactDepth;

// Samples a free flight through a grid. `depth` is the optical depth up to the first tentative collision;
// the random numbers of later collisions come from `stream`.
template <bool kChromatic, Lookup kLookup>
Flight fly_grid(const Medium& m, int hero, float depth, const V3& o, const V3& d, float t_max,
                RandomStream stream, MediumCounters& counters) {
  Flight f;
  const float s = m.sigma_t[hero];
  // Which cells are integrated exactly must not depend on the hero: the densities of all channels must refer
  // to the same sampling method.
  const float s_max = kChromatic ? max_component(m.sigma_t) : s;
  // The integral so far. Its integrand is the majorant or, in cells that are integrated exactly, the density.
  [[maybe_unused]] double passed = 0;
  [[maybe_unused]] int nulls = 0;
  // The ratio of the transmittances of channel c and the hero, times sigma_c / s for each null collision. The
  // two are combined because each factor alone may overflow float32.
  [[maybe_unused]] const auto ratio = [&](int c, double integral) {
    const float sigma = m.sigma_t[c];
    if (nulls == 0) return transmittance_ratio(sigma, s, static_cast<float>(integral));
    if (!(sigma > 0)) return 0.f;
    return std::exp(static_cast<float>(nulls * std::log(double{sigma} / s) - (double{sigma} - s) * integral));
  };
  const auto scatter = [&](double t, [[maybe_unused]] double integral) {
    f.scattered = true;
    f.t = static_cast<float>(t);
    const C3 scattering = m.scattering_at(o + d * f.t);
    for (int c = 0; c < 3; ++c) {
      if constexpr (kChromatic) {
        const float r = ratio(c, integral);
        f.weight[c] = r * scattering[c] / s;
        f.density[c] = r * m.sigma_t[c] / s;
      } else {
        f.weight[c] = scattering[c] / s;
      }
    }
    return f;
  };
  for (CellWalk w(*m.density, o, d, 0, t_max); w.next();) {
    const float hi = w.cell().hi, length = w.end() - w.begin(), rate = s * hi, room = rate * length;
    if (s_max * hi * length > kExactDepthOf<kLookup>) [[unlikely]] {
      // A hero without extinction passes through the cell, but the other channels still need the integral.
      const Passage p = m.density->pass(w.origin(), w.direction(), w.begin(), w.end(),
                                        s > 0 ? double{depth} / s : std::numeric_limits<double>::infinity());
      if (p.reached) return scatter(w.entry() + p.t, passed + p.integral);
      if (s > 0) depth = std::max(0.f, depth - static_cast<float>(s * p.integral));
      if constexpr (kChromatic) passed += p.integral;
      continue;
    }
    if (rate > 0) {
      // `gone` is the optical depth measured from the beginning of this cell, so that small distances within
      // the cell stay exact.
      float gone = depth;
      for (; gone < room; gone += stream.exponential()) {
        const float t = std::min(w.begin() + gone / rate, w.end());
        const float rho = m.density->value<kLookup>(w.index(t));
        if (rho > hi) ++counters.majorant_violations;
        if (stream.uniform() * hi < rho) return scatter(w.entry() + t, passed + double{gone} / s);
        if constexpr (kChromatic) ++nulls;
      }
      depth = gone - room;
    }
    if constexpr (kChromatic) passed += double{hi} * length;
  }
  f.t = t_max;
  if constexpr (kChromatic) {
    for (int c = 0; c < 3; ++c) f.weight[c] = f.density[c] = ratio(c, passed);
  }
  return f;
}

// Russian roulette of transmittance: once its estimate is below e^-4, a tracker survives with probability
// estimate / e^-4 and continues with the estimate e^-4. The decision depends on the whole estimate so far,
// not on the optical depth of the control values alone. For a ray that misses the dense voxel of an otherwise
// empty cell, that depth is large, but the factors of the collisions compensate for it, and the transmittance
// is 1 (docs/measurements/stability.md N10). Roulette is played only in cells with a residual to track:
// constant densities cost nothing, and their tails are exact (stability.md N05).
inline constexpr float kRouletteDepth = 4;
inline constexpr float kRouletteTransmittance = .018315639f;

// Tells transmittance_grid() that nobody asks for transmittances at points on the way.
struct Unwatched {
  static constexpr bool kWatches = false;
};
// The estimate up to each of some points, in ascending order of their distances from t = 0. The points up to
// t0 must have been taken out, and there are none beyond t1.
struct WatchedPoints {
  static constexpr bool kWatches = true;
  std::span<const float> t;
  C3* through;
  std::size_t next = 0;

  // Sets the estimates up to the distance `end`, to value(t).
  template <class Value>
  void pass(double end, const Value& value) {
    for (; next < t.size() && t[next] <= end; ++next) through[next] = value(t[next]);
  }
};

template <bool kChromatic, Lookup kLookup, class Watch = Unwatched>
C3 transmittance_grid(const Medium& m, const V3& o, const V3& d, float t0, float t1, RandomStream stream,
                      [[maybe_unused]] Watch watch = {}) {
  const float s_max = kChromatic ? max_component(m.sigma_t) : m.sigma_t.x;
  if (!(s_max > 0)) return {1, 1, 1};
  constexpr int kChannels = kChromatic ? 3 : 1;
  // The estimate is factor * exp(-sigma control). Once the control's optical depth exceeds `foldable`, its
  // exponential is multiplied into the factors, so that both stay within float32.
  float control = 0, foldable = kRouletteDepth, factor[kChannels];
  for (float& x : factor) x = 1;
  // The optical depth of the residual up to the next collision; it carries over from cell to cell.
  float left = stream.exponential();
  // The estimate so far, with this much more control depth
  [[maybe_unused]] const auto estimate = [&](float more) {
    C3 t;
    for (int c = 0; c < kChannels; ++c) t[c] = std::exp(-m.sigma_t[c] * (control + more)) * factor[c];
    if constexpr (!kChromatic) t.y = t.z = t.x;
    return t;
  };
  for (CellWalk w(*m.density, o, d, t0, t1); w.next();) {
    const MacroCell& cell = w.cell();
    const float length = w.end() - w.begin(), rate = s_max * cell.residual, room = rate * length;
    if constexpr (Watch::kWatches) watch.pass(w.entry() + w.begin(), [&](float) { return estimate(0); });
    if (room > kExactDepthOf<kLookup>) [[unlikely]] {
      if constexpr (Watch::kWatches)
        watch.pass(w.entry() + w.end(), [&](float t) {
          const auto to = std::clamp(static_cast<float>(t - w.entry()), w.begin(), w.end());
          return estimate(
              static_cast<float>(m.density->pass(w.origin(), w.direction(), w.begin(), to).integral));
        });
      control += static_cast<float>(m.density->pass(w.origin(), w.direction(), w.begin(), w.end()).integral);
    } else {
      // The control depth up to t, which is not in `control` yet
      [[maybe_unused]] const auto within = [&](float t) {
        return estimate(cell.control * std::max(0.f, static_cast<float>(t - w.entry()) - w.begin()));
      };
      if constexpr (!Watch::kWatches) control += cell.control * length;
      if (rate > 0) {
        float gone = left;
        for (; gone < room; gone += stream.exponential()) {
          const float t = w.begin() + gone / rate;
          if constexpr (Watch::kWatches) watch.pass(w.entry() + t, within);
          const float r = (m.density->value<kLookup>(w.index(t)) - cell.control) / cell.residual;
          for (int c = 0; c < kChannels; ++c) factor[c] *= 1 - r * (kChromatic ? m.sigma_t[c] / s_max : 1.f);
        }
        left = gone - room;
      }
      if constexpr (Watch::kWatches) {
        watch.pass(w.entry() + w.end(), within);
        control += cell.control * length;
      }
    }
    if (s_max * control > foldable) [[unlikely]] {
      float largest = 0;
      for (int c = 0; c < kChannels; ++c) {
        factor[c] *= std::exp(-m.sigma_t[c] * control);
        largest = std::max(largest, factor[c]);
      }
      control = 0;
      foldable = 1;
      [[maybe_unused]] const auto end_black = [&] {
        if constexpr (Watch::kWatches) watch.pass(t1, [](float) { return C3(0); });
        return C3(0);
      };
      if (!(largest > 0)) return end_black();
      if (largest < kRouletteTransmittance && rate > 0) {
        const float q = largest / kRouletteTransmittance;
        if (!(stream.uniform() < q)) return end_black();
        for (float& x : factor) x /= q;
      }
    }
  }
  if constexpr (Watch::kWatches) watch.pass(t1, [&](float) { return estimate(0); });
  C3 t;
  for (int c = 0; c < kChannels; ++c) t[c] = std::exp(-m.sigma_t[c] * control) * factor[c];
  if constexpr (!kChromatic) t.y = t.z = t.x;
  return t;
}

template <bool kChromatic>
C3 transmittance_homogeneous(const Medium& m, float length) {
  LS_COUNT(transmittance);
  if constexpr (kChromatic) {
    C3 t;
    for (int c = 0; c < 3; ++c) t[c] = m.sigma_t[c] > 0 ? std::exp(-m.sigma_t[c] * length) : 1.f;
    return t;
  } else {
    return C3(m.sigma_t.x > 0 ? std::exp(-m.sigma_t.x * length) : 1.f);
  }
}

template <bool kChromatic>
C3 transmittance_height(const Medium& m, const V3& o, const V3& d, float t0, float t1) {
  const HeightRay ray(*m.height, o + d * t0, d);
  return transmittance_homogeneous<kChromatic>(m, static_cast<float>(ray.depth(double{t1} - t0)));
}

// Grids without interpolation, and fields, are rare. Their functions are not inlined, so that they do not
// slow down the code for other grids.
template <bool kChromatic>
[[gnu::noinline]] Flight fly_uncommon(const Medium& m, int hero, float depth, const V3& o, const V3& d,
                                      float t_max, RandomStream stream, MediumCounters& counters) {
  if (m.density->lookup() == Lookup::field)
    return fly_grid<kChromatic, Lookup::field>(m, hero, depth, o, d, t_max, stream, counters);
  return fly_grid<kChromatic, Lookup::nearest>(m, hero, depth, o, d, t_max, stream, counters);
}
template <bool kChromatic>
[[gnu::noinline]] C3 transmittance_uncommon(const Medium& m, const V3& o, const V3& d, float t0, float t1,
                                            RandomStream stream) {
  if (m.density->lookup() == Lookup::field)
    return transmittance_grid<kChromatic, Lookup::field>(m, o, d, t0, t1, stream);
  return transmittance_grid<kChromatic, Lookup::nearest>(m, o, d, t0, t1, stream);
}

}  // namespace detail

// Samples the distance to the next scattering along o + t d (d of unit length), if there is one before
// t_max. The random word `bits` determines the first tentative collision, and `stream` the later ones.
template <Features F>
Flight free_flight(const Medium& m, int hero, std::uint32_t bits, const V3& o, const V3& d, float t_max,
                   RandomStream stream, MediumCounters& counters) {
  const float depth = exponential(bits);
  if constexpr (F.grids) {
    if constexpr (F.chromatic) {
      if (m.by_channel[0]) [[unlikely]]
        return fly_channels(m, hero, depth, o, d, t_max, stream, counters);
    }
    if (m.grid && m.density->lookup() != Lookup::trilinear) [[unlikely]]
      return detail::fly_uncommon<F.chromatic>(m, hero, depth, o, d, t_max, stream, counters);
    if (m.grid)
      return detail::fly_grid<F.chromatic, Lookup::trilinear>(m, hero, depth, o, d, t_max, stream, counters);
  }
  if constexpr (F.height) {
    if (m.height) return detail::fly_height<F.chromatic>(m, hero, depth, o, d, t_max);
  }
  return detail::fly_homogeneous<F.chromatic>(m, hero, depth, t_max);
}

// Returns the Flight (weight and density) through the medium m for a path that was not scattered by m up to
// t, because another medium at the same place ended the flight there. In grids the exact optical depth is
// used, so that the result does not depend on how that flight was sampled.
Flight passed(const Medium& m, int hero, const V3& o, const V3& d, float t);

// Returns the same as transmittance() from 0 to t1, with the same random numbers, and sets through[i] to an
// unbiased estimate of the transmittance up to points[i]. The points are ascending, and not beyond t1.
C3 transmittance_to_points(const Medium& m, const V3& o, const V3& d, float t1, RandomStream stream,
                           std::span<const float> points, C3* through);

// Returns an unbiased estimate of the transmittance along o + t d between t0 and t1; the exact value in media
// that are no grids.
template <Features F>
C3 transmittance(const Medium& m, const V3& o, const V3& d, float t0, float t1, RandomStream stream) {
  if constexpr (F.grids) {
    if constexpr (F.chromatic) {
      if (m.by_channel[0]) [[unlikely]]
        return transmittance_channels(m, o, d, t0, t1, stream);
    }
    if (m.grid && m.density->lookup() != Lookup::trilinear) [[unlikely]]
      return detail::transmittance_uncommon<F.chromatic>(m, o, d, t0, t1, stream);
    if (m.grid) return detail::transmittance_grid<F.chromatic, Lookup::trilinear>(m, o, d, t0, t1, stream);
  }
  if constexpr (F.height) {
    if (m.height) return detail::transmittance_height<F.chromatic>(m, o, d, t0, t1);
  }
  return detail::transmittance_homogeneous<F.chromatic>(m, t1 - t0);
}

}  // namespace ls::render
