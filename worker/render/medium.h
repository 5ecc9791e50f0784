// Participating media: free flight and transmittance. Homogeneous media in closed form; grids by delta
// tracking with local majorants and by residual ratio tracking (Novak et al. 2014) with one control per macro
// cell.
//
// Chromatic extinction: one channel, the hero, drawn once per path, decides every distance. A flight returns
// the path weight relative to the hero (`weight`) and every channel's density for what was sampled, relative
// to the hero's
// (`density`); dividing by the mean over channels of the accumulated densities is the balance heuristic over
// channels (Miller, Georgiev, Jarosz 2019). With equal channels every ratio is exactly 1, so grey code may
// leave them out.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "worker/render/features.h"
#include "worker/render/grid.h"
#include "worker/render/hash.h"
#include "worker/render/math.h"
#include "worker/render/phase.h"
#include "worker/render/sampler.h"

namespace ls::render {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Medium {
  bool grid = false;
  // Homogeneous: extinction and scattering [1/world unit]. Grid: extinction per unit of density; scattering
  // is albedo times it.
  C3 sigma_t{0, 0, 0}, sigma_s{0, 0, 0};
  const Grid* density = nullptr;
  std::array<const Grid*, 3> albedo{};  // null: constant, already in sigma_s
  HenyeyGreenstein phase;
  bool chromatic() const { return sigma_t.x != sigma_t.y || sigma_t.y != sigma_t.z; }

  // Scattering coefficient per unit of extinction density at a point of a grid.
  C3 scattering_at(const V3& p) const {
    if (!albedo[0]) return sigma_s;
    C3 s;
    for (int k = 0; k < 3; ++k) {
      const V3 q = albedo[k]->to_index(p);
      s[k] = sigma_t[k] * std::min(1.f, albedo[k]->value_anywhere(q));
    }
    return s;
  }
};

struct Flight {
  bool scattered = false;
  float t = 0;
  C3 weight{1, 1, 1};
  C3 density{1, 1, 1};  // only meaningful in chromatic code
};

// Counted, never hidden: a density above its bound would bias silently.
struct MediumCounters {
  std::uint64_t majorant_violations = 0;
};

namespace detail {

// T_c / T_hero over a length: one exponential of the difference, never a quotient of underflown ones; 1 if
// they are equal.
inline float transmittance_ratio(float sigma_c, float sigma_hero, float length) {
  const float diff = sigma_c - sigma_hero;
  return diff == 0 ? 1.f : std::exp(-diff * length);
}

template <bool kChromatic>
Flight fly_homogeneous(const Medium& m, int hero, float depth, float t_max) {
  Flight f;
  const float s = m.sigma_t[hero];
  f.t = s > 0 ? depth / s : kInfinity;
  f.scattered = f.t < t_max;
  if constexpr (kChromatic) {
    const float length = f.scattered ? f.t : t_max;
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
  return f;
}

// `depth`: the optical depth of the first tentative collision; the stream gives the rest.
template <bool kChromatic, VolumeFilter kFilter>
Flight fly_grid(const Medium& m, int hero, float depth, const V3& o, const V3& d, float t_max,
                RandomStream stream, MediumCounters& counters) {
  Flight f;
  const float s = m.sigma_t[hero];
  if (!(s > 0)) {
    // The hero sees nothing; other channels may: their transmittance needs the integral of the majorant it
    // did not track.
    if constexpr (kChromatic) {
      float passed = 0;
      for (CellWalk w(*m.density, o, d, 0, t_max); w.next();) passed += w.cell().hi * (w.end() - w.begin());
      for (int c = 0; c < 3; ++c)
        f.weight[c] = f.density[c] = m.sigma_t[c] > 0 ? std::exp(-m.sigma_t[c] * passed) : 1.f;
    }
    f.t = t_max;
    return f;
  }
  float passed = 0;  // integral of the majorant density up to here
  [[maybe_unused]] C3 nulls{1, 1, 1};
  for (CellWalk w(*m.density, o, d, 0, t_max); w.next();) {
    const float hi = w.cell().hi, rate = s * hi;
    if (!(rate > 0)) continue;
    float t = w.begin();
    for (;;) {
      const float room = rate * (w.end() - t);
      if (!(depth < room)) {
        depth -= room;
        if constexpr (kChromatic) passed += hi * (w.end() - t);
        break;
      }
      const float dt = depth / rate;
      t = std::min(t + dt, w.end());
      if constexpr (kChromatic) passed += hi * dt;
      const float rho = m.density->value<kFilter>(w.index(t));
      if (rho > hi) ++counters.majorant_violations;
      if (stream.uniform() * hi < rho) {
        f.scattered = true;
        f.t = t;
        const C3 scattering = m.scattering_at(o + d * t);
        for (int c = 0; c < 3; ++c) {
          if constexpr (kChromatic) {
            const float ratio = transmittance_ratio(m.sigma_t[c], s, passed) * nulls[c];
            f.weight[c] = ratio * scattering[c] / s;
            f.density[c] = ratio * m.sigma_t[c] / s;
          } else {
            f.weight[c] = scattering[c] / s;
          }
        }
        return f;
      }
      if constexpr (kChromatic) {
        for (int c = 0; c < 3; ++c) nulls[c] *= m.sigma_t[c] / s;
      }
      depth = stream.exponential();
    }
  }
  f.t = t_max;
  if constexpr (kChromatic) {
    for (int c = 0; c < 3; ++c)
      f.weight[c] = f.density[c] = transmittance_ratio(m.sigma_t[c], s, passed) * nulls[c];
  }
  return f;
}

// Where so little light is left, the rest of the way is walked by few: from this optical depth on a tracker
// survives each further unit of depth with probability 1/e and is weighted by e. Unbiased.
inline constexpr float kRouletteDepth = 4;

template <bool kChromatic, VolumeFilter kFilter>
C3 transmittance_grid(const Medium& m, const V3& o, const V3& d, float t0, float t1, RandomStream stream) {
  float s_max = m.sigma_t.x, s_min = m.sigma_t.x;
  if constexpr (kChromatic) {
    s_max = max_component(m.sigma_t);
    s_min = std::min(m.sigma_t.x, std::min(m.sigma_t.y, m.sigma_t.z));
  }
  if (!(s_max > 0)) return {1, 1, 1};
  float control = 0, factor = 1, roulette = kRouletteDepth;
  [[maybe_unused]] C3 factors{1, 1, 1};
  for (CellWalk w(*m.density, o, d, t0, t1); w.next();) {
    const MacroCell& cell = w.cell();
    control += cell.control * (w.end() - w.begin());
    const float rate = s_max * cell.residual;
    if (rate > 0) {
      for (float t = w.begin() + stream.exponential() / rate; t < w.end(); t += stream.exponential() / rate) {
        const float r = (m.density->value<kFilter>(w.index(t)) - cell.control) / cell.residual;
        if constexpr (kChromatic) {
          for (int c = 0; c < 3; ++c) factors[c] *= 1 - r * (m.sigma_t[c] / s_max);
        } else {
          factor *= 1 - r;
        }
      }
    }
    while (s_min * control > roulette) {
      if (stream.uniform() > .36787944f) return {0, 0, 0};
      if constexpr (kChromatic) {
        factors *= 2.71828183f;
      } else {
        factor *= 2.71828183f;
      }
      roulette += 1;
    }
  }
  if constexpr (kChromatic) {
    C3 t;
    for (int c = 0; c < 3; ++c) t[c] = std::exp(-m.sigma_t[c] * control) * factors[c];
    return t;
  } else {
    return C3(std::exp(-s_max * control) * factor);
  }
}

template <bool kChromatic>
C3 transmittance_homogeneous(const Medium& m, float length) {
  if constexpr (kChromatic) {
    C3 t;
    for (int c = 0; c < 3; ++c) t[c] = m.sigma_t[c] > 0 ? std::exp(-m.sigma_t[c] * length) : 1.f;
    return t;
  } else {
    return C3(m.sigma_t.x > 0 ? std::exp(-m.sigma_t.x * length) : 1.f);
  }
}

// Grids without interpolation are rare: they have their own code, out of the way of the others'.
template <bool kChromatic>
[[gnu::noinline]] Flight fly_nearest(const Medium& m, int hero, float depth, const V3& o, const V3& d,
                                     float t_max, RandomStream stream, MediumCounters& counters) {
  return fly_grid<kChromatic, VolumeFilter::nearest>(m, hero, depth, o, d, t_max, stream, counters);
}
template <bool kChromatic>
[[gnu::noinline]] C3 transmittance_nearest(const Medium& m, const V3& o, const V3& d, float t0, float t1,
                                           RandomStream stream) {
  return transmittance_grid<kChromatic, VolumeFilter::nearest>(m, o, d, t0, t1, stream);
}

}  // namespace detail

// Distance to the next scattering along o + t d (d of unit length), or none before t_max. `bits` decides the
// first tentative collision; `stream` the others.
template <Features F>
Flight free_flight(const Medium& m, int hero, std::uint32_t bits, const V3& o, const V3& d, float t_max,
                   RandomStream stream, MediumCounters& counters) {
  const float depth = exponential(bits);
  if constexpr (F.grids) {
    if (m.grid && m.density->filter() == VolumeFilter::nearest) [[unlikely]]
      return detail::fly_nearest<F.chromatic>(m, hero, depth, o, d, t_max, stream, counters);
    if (m.grid)
      return detail::fly_grid<F.chromatic, VolumeFilter::trilinear>(m, hero, depth, o, d, t_max, stream,
                                                                    counters);
  }
  return detail::fly_homogeneous<F.chromatic>(m, hero, depth, t_max);
}

// Unbiased estimate (exact where homogeneous) of the transmittance between t0 and t1.
template <Features F>
C3 transmittance(const Medium& m, const V3& o, const V3& d, float t0, float t1, RandomStream stream) {
  if constexpr (F.grids) {
    if (m.grid && m.density->filter() == VolumeFilter::nearest) [[unlikely]]
      return detail::transmittance_nearest<F.chromatic>(m, o, d, t0, t1, stream);
    if (m.grid)
      return detail::transmittance_grid<F.chromatic, VolumeFilter::trilinear>(m, o, d, t0, t1, stream);
  }
  return detail::transmittance_homogeneous<F.chromatic>(m, t1 - t0);
}

}  // namespace ls::render
