// Free flight and transmittance through grids whose density differs between channels, that is, from files
// with three channels.
//
// Each channel has local majorants of its own. Those of the hero (the channel that decides distances:
// medium.h) determine the tentative collisions and their type. The `density` of another channel is the
// density with which the majorants of that channel would have given the same collisions: their transmittance
// times the null-collision coefficients (majorant - density), relative to the same product of the hero.
// Dividing by the mean over channels is the balance heuristic. It keeps weights below 3, whereas the ratios
// alone are unbounded.
#include "worker/render/media/medium.h"

#include <algorithm>
#include <cmath>

namespace ls::render {
namespace {

const Grid& grid_of(const Medium& m, int c) { return *m.by_channel[static_cast<std::size_t>(c)]; }

// The macro cells of the three channels' grids at the current position of the walk w.
struct Cells {
  Cells(const Medium& m, const CellWalk& w) {
    const std::size_t k = w.number(grid_of(m, 0));
    for (int c = 0; c < 3; ++c) of[c] = &grid_of(m, c).cell(k);
  }
  float hi() const { return std::max(of[0]->hi, std::max(of[1]->hi, of[2]->hi)); }
  float residual() const { return std::max(of[0]->residual, std::max(of[1]->residual, of[2]->residual)); }
  const MacroCell* of[3];
};

// The state of one flight. It keeps the logarithms of the channels' densities, because the densities exceed
// the range of float32.
class ChannelFlight {
 public:
  ChannelFlight(const Medium& m, int hero, const V3& o, const V3& d) : m_(m), hero_(hero), o_(o), d_(d) {}

  void pass(int c, double depth) { log_[c] -= depth; }
  // Adds null collisions. product[c] is a product over these collisions: (majorant - density) of channel c,
  // divided by (majorant - density) of the hero.
  void add_nulls(const double (&product)[3]) {
    // A product of 0 gives the logarithm -infinity: such a flight is impossible in that channel.
    for (int c = 0; c < 3; ++c) log_[c] += std::log(product[c]);
  }
  Flight scattered(double t, const C3& rho) const {
    Flight f;
    f.scattered = true;
    f.t = static_cast<float>(t);
    // Because of rounding, the integral over a cell may, very rarely, end at a point where the hero's density
    // is 0.
    if (!(rho[hero_] > 0)) {
      f.weight = C3(0);
      return f;
    }
    const C3 scattering = m_.scattering_at(o_ + d_ * f.t);
    for (int c = 0; c < 3; ++c) {
      const float r = ratio(c) * (rho[c] / rho[hero_]);
      f.density[c] = r;
      f.weight[c] = r * scattering[c] / m_.sigma_t[c];
    }
    return f;
  }
  Flight through(float t) const {
    Flight f;
    f.t = t;
    for (int c = 0; c < 3; ++c) f.weight[c] = f.density[c] = ratio(c);
    return f;
  }

 private:
  float ratio(int c) const { return c == hero_ ? 1.f : static_cast<float>(std::exp(log_[c] - log_[hero_])); }

  const Medium& m_;
  const int hero_;
  const V3 o_, d_;
  double log_[3] = {0, 0, 0};
};

}  // namespace

C3 densities(const Medium& m, const V3& index) {
  C3 rho;
  for (int c = 0; c < 3; ++c) {
    const Grid& g = grid_of(m, c);
    rho[c] =
        g.lookup() == Lookup::trilinear ? g.value<Lookup::trilinear>(index) : g.value<Lookup::nearest>(index);
  }
  return rho;
}

Flight fly_channels(const Medium& m, int hero, float depth, const V3& o, const V3& d, float t_max,
                    RandomStream stream, MediumCounters& counters) {
  ChannelFlight flight(m, hero, o, d);
  const float s = m.sigma_t.x;
  if (!(s > 0)) return flight.through(t_max);
  for (CellWalk w(grid_of(m, 0), o, d, 0, t_max); w.next();) {
    const Cells cells(m, w);
    const float length = w.end() - w.begin(), hi = cells.of[hero]->hi, rate = s * hi, room = rate * length;
    // Which cells are integrated exactly must not depend on the hero (see fly_grid in medium.h).
    if (s * cells.hi() * length > detail::kExactDepth) [[unlikely]] {
      const Passage p =
          grid_of(m, hero).pass(w.origin(), w.direction(), w.begin(), w.end(), double{depth} / s);
      const float end = p.reached ? p.t : w.end();
      for (int c = 0; c < 3; ++c) {
        const double integral =
            c == hero ? p.integral : grid_of(m, c).pass(w.origin(), w.direction(), w.begin(), end).integral;
        flight.pass(c, s * integral);
      }
      if (p.reached) return flight.scattered(w.entry() + end, densities(m, w.index(end)));
      depth = std::max(0.f, depth - static_cast<float>(s * p.integral));
      continue;
    }
    if (rate > 0) {
      double nulls[3] = {1, 1, 1};
      float gone = depth;
      for (; gone < room; gone += stream.exponential()) {
        const float t = std::min(w.begin() + gone / rate, w.end());
        const C3 rho = densities(m, w.index(t));
        for (int c = 0; c < 3; ++c)
          if (rho[c] > cells.of[c]->hi) ++counters.majorant_violations;
        if (stream.uniform() * hi < rho[hero]) {
          flight.add_nulls(nulls);
          for (int c = 0; c < 3; ++c) flight.pass(c, double{cells.of[c]->hi} / hi * gone);
          return flight.scattered(w.entry() + t, rho);
        }
        for (int c = 0; c < 3; ++c)
          nulls[c] *= std::max(0.f, cells.of[c]->hi - rho[c]) / double{hi - rho[hero]};
      }
      flight.add_nulls(nulls);
      depth = gone - room;
    }
    for (int c = 0; c < 3; ++c) flight.pass(c, double{s} * cells.of[c]->hi * length);
  }
  return flight.through(t_max);
}

// The channels share one sequence of collisions, at the rate of the largest of their residuals. Otherwise
// this is the same as transmittance_grid (medium.h).
C3 transmittance_channels(const Medium& m, const V3& o, const V3& d, float t0, float t1,
                          RandomStream stream) {
  const float s = m.sigma_t.x;
  if (!(s > 0)) return {1, 1, 1};
  float control[3] = {0, 0, 0}, factor[3] = {1, 1, 1}, foldable = detail::kRouletteDepth;
  float left = stream.exponential();
  for (CellWalk w(grid_of(m, 0), o, d, t0, t1); w.next();) {
    const Cells cells(m, w);
    const float length = w.end() - w.begin(), residual = cells.residual(), rate = s * residual,
                room = rate * length;
    if (room > detail::kExactDepth) [[unlikely]] {
      for (int c = 0; c < 3; ++c)
        control[c] += static_cast<float>(
            s * grid_of(m, c).pass(w.origin(), w.direction(), w.begin(), w.end()).integral);
    } else {
      for (int c = 0; c < 3; ++c) control[c] += s * cells.of[c]->control * length;
      if (rate > 0) {
        float gone = left;
        for (; gone < room; gone += stream.exponential()) {
          const C3 rho = densities(m, w.index(w.begin() + gone / rate));
          for (int c = 0; c < 3; ++c) factor[c] *= 1 - (rho[c] - cells.of[c]->control) / residual;
        }
        left = gone - room;
      }
    }
    if (!(std::max(control[0], std::max(control[1], control[2])) > foldable)) continue;
    float largest = 0;
    for (int c = 0; c < 3; ++c) {
      factor[c] *= std::exp(-control[c]);
      control[c] = 0;
      largest = std::max(largest, factor[c]);
    }
    foldable = 1;
    if (!(largest > 0)) return {0, 0, 0};
    if (largest < detail::kRouletteTransmittance && rate > 0) {
      const float q = largest / detail::kRouletteTransmittance;
      if (!(stream.uniform() < q)) return {0, 0, 0};
      for (float& x : factor) x /= q;
    }
  }
  C3 t;
  for (int c = 0; c < 3; ++c) t[c] = std::exp(-control[c]) * factor[c];
  return t;
}

C3 transmittance_to_points(const Medium& m, const V3& o, const V3& d, float t1, RandomStream stream,
                           std::span<const float> points, C3* through) {
  if (m.grid && !m.by_channel[0]) {
    // Without extinction nothing is watched.
    std::fill_n(through, points.size(), C3(1));
    const detail::WatchedPoints watch{points, through};
    switch (m.density->lookup()) {
      case Lookup::trilinear:
        return detail::transmittance_grid<true, Lookup::trilinear>(m, o, d, 0, t1, stream, watch);
      case Lookup::nearest:
        return detail::transmittance_grid<true, Lookup::nearest>(m, o, d, 0, t1, stream, watch);
      case Lookup::field:
        return detail::transmittance_grid<true, Lookup::field>(m, o, d, 0, t1, stream, watch);
    }
  }
  const auto up_to = [&](float t) {
    if (m.grid) return transmittance_channels(m, o, d, 0, t, stream);
    return m.height ? detail::transmittance_height<true>(m, o, d, 0, t)
                    : detail::transmittance_homogeneous<true>(m, t);
  };
  for (std::size_t i = 0; i < points.size(); ++i) through[i] = points[i] > 0 ? up_to(points[i]) : C3(1);
  return up_to(t1);
}

namespace {

Flight passed_channels(const Medium& m, int hero, const V3& o, const V3& d, float t) {
  ChannelFlight flight(m, hero, o, d);
  for (CellWalk w(grid_of(m, 0), o, d, 0, t); w.next();)
    for (int c = 0; c < 3; ++c)
      flight.pass(c,
                  m.sigma_t.x * grid_of(m, c).pass(w.origin(), w.direction(), w.begin(), w.end()).integral);
  return flight.through(t);
}

}  // namespace

Flight passed(const Medium& m, int hero, const V3& o, const V3& d, float t) {
  if (m.by_channel[0]) return passed_channels(m, hero, o, d, t);
  double depth = t;
  if (m.grid) {
    depth = 0;
    for (CellWalk w(*m.density, o, d, 0, t); w.next();)
      if (w.cell().hi > 0) depth += m.density->pass(w.origin(), w.direction(), w.begin(), w.end()).integral;
  } else if (m.height) {
    depth = HeightRay(*m.height, o, d).depth(t);
  }
  Flight f;
  f.t = t;
  for (int c = 0; c < 3; ++c)
    f.weight[c] = f.density[c] =
        detail::transmittance_ratio(m.sigma_t[c], m.sigma_t[hero], static_cast<float>(depth));
  return f;
}

}  // namespace ls::render
