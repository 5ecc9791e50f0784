#include "worker/render/media/emission.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "worker/render/math/blackbody.h"

namespace ls::render {
namespace {

constexpr double kNoBoundary = std::numeric_limits<double>::infinity();

// The maximum length, in voxels of the density or the emission grid, of an interval that gets one emission
// sample.
constexpr double kOpticalDepthVoxels = 1;

// Returns the emission at the world point p, which has the index coordinates q in the emission grid. For
// emission per length it is radiance per length. For emission per absorption it is a radiance; this times the
// absorption coefficient is the radiance per length.
V3d source_at(const Medium& m, const V3& q, const V3& p) {
  V3d e(m.emission);
  if (!m.emitter[0]) return e;
  if (m.emission_kind == EmissionKind::black_body) {
    const float kelvin = m.kelvin_offset + m.kelvin_scale * m.emitter[0]->value_anywhere(q);
    double weight = 1;
    if (m.weight) {
      const V3 at = m.weight->to_index(p);
      weight = m.weight->in_domain(at) ? m.weight->value_anywhere(at) : 0;
    }
    return e * V3d(m.peak_one ? black_body_of_peak_one(kelvin) : black_body_radiance(kelvin)) * weight;
  }
  for (int c = 0; c < 3; ++c) e[c] *= m.emitter[c]->value_anywhere(q);
  return e;
}

// Returns the share of the extinction at the world point p that is absorption.
C3 absorbing_at(const Medium& m, const V3& p) {
  if (!m.albedo[0]) return m.absorbing;
  const C3 scattering = m.scattering_at(p);
  C3 a(0);
  for (int k = 0; k < 3; ++k)
    if (m.sigma_t[k] > 0) a[k] = std::max(0.f, m.sigma_t[k] - scattering[k]) / m.sigma_t[k];
  return a;
}

// Walks along a ray through the cells of a grid. The functions take positions as distances from the ray's
// origin. A position may be in the current cell, in front of it, or past the grid.
class Steps {
 public:
  Steps(const Grid& grid, const V3& o, const V3& d, float t_max) : walk_(grid, o, d, 0, t_max) {
    more_ = walk_.next();
    if (!more_) return;
    const V3 v = walk_.direction();
    longest_ = kOpticalDepthVoxels / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  void advance(double at) {
    while (more_ && end() <= at) more_ = walk_.next();
  }
  bool past() const { return !more_; }
  bool inside(double at) const { return more_ && begin() <= at; }
  // Returns the next boundary after `at`, as a distance from the ray's origin. That is the beginning of the
  // walk's current cell if `at` lies in front of this cell, else the cell's end.
  double boundary(double at) const { return !more_ ? kNoBoundary : begin() <= at ? end() : begin(); }
  double longest() const { return longest_; }
  const MacroCell& cell() const { return walk_.cell(); }
  // local() converts a distance from the ray's origin to a distance from the point of entry into the grid;
  // distance() converts back.
  float local(double t) const { return static_cast<float>(t - walk_.entry()); }
  double distance(float local) const { return walk_.entry() + local; }
  V3 index(double t) const { return walk_.index(local(t)); }
  Passage pass(const Grid& grid, double a, double b, double wanted = kNoBoundary) const {
    return grid.pass(walk_.origin(), walk_.direction(), local(a), local(b), wanted);
  }

 private:
  double begin() const { return walk_.entry() + walk_.begin(); }
  double end() const { return walk_.entry() + walk_.end(); }

  CellWalk walk_;
  bool more_ = false;
  double longest_ = kNoBoundary;
};

class EmissionWalk {
 public:
  EmissionWalk(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream)
      : m_(m),
        o_(o),
        d_(d),
        end_(t_max),
        stream_(stream),
        density_(*m.density, o, d, t_max),
        channels_(m.chromatic() ? 3 : 1),
        s_max_(max_component(m.sigma_t)) {
    if (m.emitter[0]) emitter_.emplace(*m.emitter[0], o, d, t_max);
  }

  C3 run() {
    for (double at = 0; at < end_;) {
      density_.advance(at);
      if (emitter_) emitter_->advance(at);
      if ((emitter_ && emitter_->past()) || (m_.emission_kind != EmissionKind::per_length && density_.past()))
        break;
      const MacroCell* cell = density_.inside(at) ? &density_.cell() : nullptr;
      const bool absorbs = cell && s_max_ * cell->hi > 0, shines = may_shine(at, cell);
      const double to = end_of_constant_part(at, absorbs && shines ? cell : nullptr);
      if (absorbs)
        add_absorbed(at, to, shines, cell->residual == 0);
      else if (shines)
        add_clear(at, to);
      if (!goes_on()) break;
      at = to;
    }
    return C3(sum_);
  }

 private:
  bool may_shine(double at, const MacroCell* cell) const {
    if (m_.emission_kind != EmissionKind::per_length && !(cell && cell->hi > 0)) return false;
    if (!emitter_) return true;
    if (!emitter_->inside(at)) return false;
    // `emitter_` walks the grid of the first channel. If the channels have different grids, the bounds of the
    // others are unknown, so the cell is assumed to emit.
    if (m_.emitter[1] != m_.emitter[0]) return true;
    return may_emit(m_, emitter_->cell().hi);
  }

  // Returns the end of the interval that begins at `at` and that run() integrates as one. `sampled` is the
  // density grid's cell if the interval is to get an emission sample, else null.
  double end_of_constant_part(double at, const MacroCell* sampled) const {
    double to = std::min(end_, density_.boundary(at));
    if (emitter_) to = std::min(to, emitter_->boundary(at));
    if (!sampled) return to;
    if (emitter_) to = std::min(to, at + emitter_->longest());
    const bool varies =
        m_.emission_kind == EmissionKind::per_length ? sampled->residual > 0 : m_.albedo[0] != nullptr;
    return varies ? std::min(to, at + density_.longest()) : to;
  }

  V3 point(double t) const { return o_ + d_ * static_cast<float>(t); }
  V3d source(double t) const { return source_at(m_, emitter_ ? emitter_->index(t) : V3(0), point(t)); }
  double density_at(double t) const { return m_.density->value_anywhere(density_.index(t)); }
  double depth(double a, double b) const { return density_.pass(*m_.density, a, b).integral; }

  // Adds the emission of an interval to the sum: e times `share` times the transmittance up to the interval.
  // Adds it to channel c alone or, if all channels have the same extinction, to all channels.
  void add(int c, const V3d& e, double share) {
    if (channels_ == 1) {
      sum_ = sum_ + e * (through_[0] * share);
    } else {
      sum_[c] += e[c] * (through_[c] * share);
    }
  }

  // Adds the emission of an interval [a, b] without extinction. Where there is no extinction, a medium emits
  // only per length, and the grid gives the integral of this emission exactly.
  void add_clear(double a, double b) {
    double field = b - a;
    for (int c = 0; c < 3; ++c) {
      if (emitter_ && (c == 0 || m_.emitter[c] != m_.emitter[c - 1]))
        field = emitter_->pass(*m_.emitter[c], a, b).integral;
      // A channel without emission stays 0 even over an infinite length.
      if (m_.emission[c] > 0) sum_[c] += double{m_.emission[c]} * through_[channels_ == 1 ? 0 : c] * field;
    }
  }

  void add_absorbed(double a, double b, bool shines, bool uniform) {
    const double whole = depth(a, b);
    if (shines) {
      const double u = stream_.uniform(), v = stream_.uniform();
      for (int c = 0; c < channels_; ++c) {
        if (m_.emission_kind != EmissionKind::per_length)
          add_source(c, a, b, whole, u);
        else if (uniform || m_.sigma_t[c] * whole < 1)
          add_thin(c, a, b, whole, u);
        else
          add_thick(c, a, b, whole, u, v);
      }
    }
    for (int c = 0; c < channels_; ++c) through_[c] *= std::exp(-m_.sigma_t[c] * whole);
  }

  // Samples, by the random number u, the point of the interval [a, b] at which light of a channel is
  // absorbed. s is the channel's extinction per unit of density, and `absorbed` the share of light that the
  // interval absorbs.
  double absorption_point(double a, double b, double s, double absorbed, double u) const {
    const Passage p = density_.pass(*m_.density, a, b, absorption_depth(u, s, absorbed));
    return p.reached ? density_.distance(p.t) : b;
  }

  // Adds emission per absorption on [a, b], sampled in proportion to absorption: the density cancels, and a
  // constant source has no noise at all. `whole` is the density integrated over the interval.
  void add_source(int c, double a, double b, double whole, double u) {
    const double s = m_.sigma_t[c], absorbed = -std::expm1(-s * whole);
    if (!(absorbed > 0)) return;
    const double t = absorption_point(a, b, s, absorbed, u);
    V3d e = source(t);
    const C3 absorbing = absorbing_at(m_, point(t));
    for (int k = 0; k < 3; ++k) e[k] = m_.sigma_t[k] > 0 ? e[k] * absorbing[k] : 0;
    add(c, e, absorbed);
  }

  // Adds emission per length on [a, b], sampled as if the density were constant along the interval. If it
  // really is constant, points are sampled in exact proportion to the transmittance. `whole` is the density
  // integrated over the interval.
  void add_thin(int c, double a, double b, double whole, double u) {
    const double h = b - a, s = m_.sigma_t[c], k = s * whole / h, t = truncated_exponential(u, k, h);
    add(c, source(a + t), h * mean_transmittance(k * h) * std::exp(k * t - s * depth(a, a + t)));
  }

  // Adds emission per length on [a, b] by two samples that are combined by the balance heuristic, one uniform
  // and one proportional to absorption. So emission is found both in the gaps of a dense cell and at its
  // surface.
  void add_thick(int c, double a, double b, double whole, double u, double v) {
    const double h = b - a, s = m_.sigma_t[c], absorbed = -std::expm1(-s * whole);
    for (const double t : {a + u * h, absorption_point(a, b, s, absorbed, v)}) {
      const double rest = std::exp(-s * depth(a, t));
      add(c, source(t), rest / (1 / h + absorption_pdf(s, density_at(t), rest, absorbed)));
    }
  }

  // Plays Russian roulette by the transmittance so far, in the same way as for transmittance (medium.h).
  // Returns false if the integration ends.
  bool goes_on() {
    double largest = 0;
    for (int c = 0; c < channels_; ++c) largest = std::max(largest, through_[c]);
    if (!(largest > 0)) return false;
    if (largest >= detail::kRouletteTransmittance) return true;
    const double q = largest / detail::kRouletteTransmittance;
    if (!(stream_.uniform() < q)) return false;
    for (double& x : through_) x /= q;
    return true;
  }

  const Medium& m_;
  const V3 o_, d_;
  const double end_;
  RandomStream stream_;
  Steps density_;
  std::optional<Steps> emitter_;
  const int channels_;  // 1 if all channels have the same extinction, else 3
  const float s_max_;
  double through_[3] = {1, 1, 1};
  V3d sum_{0, 0, 0};
};

}  // namespace

C3 emission_at(const Medium& m, const V3& p) {
  V3 q(0);
  if (m.emitter[0]) {
    q = m.emitter[0]->to_index(p);
    if (!m.emitter[0]->in_domain(q)) return C3(0);
  }
  if (m.emission_kind == EmissionKind::per_length) return C3(source_at(m, q, p));
  const V3 at = m.density->to_index(p);
  if (!m.density->in_domain(at)) return C3(0);
  const C3 density = m.by_channel[0] ? densities(m, at) : C3(m.density->value_anywhere(at));
  return C3(source_at(m, q, p) * V3d(m.sigma_t) * V3d(absorbing_at(m, p)) * V3d(density));
}

bool may_emit(const Medium& m, float value) {
  return m.emission_kind == EmissionKind::black_body ? m.kelvin_offset + m.kelvin_scale * value >= kColdest
                                                     : value > 0;
}

C3 emission_of_length(const Medium& m, float t_max) {
  C3 light;
  for (int c = 0; c < 3; ++c) {
    const double e = m.emission[c], s = m.sigma_t[c], t = t_max;
    if (!(e > 0))
      light[c] = 0;
    else if (std::isinf(t_max))
      light[c] = static_cast<float>(e / s);
    else
      light[c] = static_cast<float>(e * t * mean_transmittance(s * t));
  }
  return light;
}

C3 emission_of_grid(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream) {
  if (m.by_channel[0]) {
    // One walk for each channel c: it computes the emission as if all channels had the density of channel c,
    // and only its result for channel c is used.
    C3 light;
    for (int c = 0; c < 3; ++c) {
      Medium one = m;
      one.density = m.by_channel[static_cast<std::size_t>(c)];
      one.by_channel = {};
      light[c] = EmissionWalk(one, o, d, t_max, stream).run()[c];
    }
    return light;
  }
  return EmissionWalk(m, o, d, t_max, stream).run();
}

}  // namespace ls::render
