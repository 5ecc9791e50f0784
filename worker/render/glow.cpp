#include "worker/render/glow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "worker/render/black_body.h"

namespace ls::render {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

// A stretch with an emission sample is at most this many voxels long, of either grid. In the thinnest grids of single
// voxels, 4 of them would have 25 times the variance.
constexpr double kStretchVoxels = 1;

// (1 - e^-x) / x, the mean of e^-t up to x.
double mean_transmittance(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// t in [0, h] with density k e^-kt / (1 - e^-kh); uniform where that is flat to double precision.
double truncated_exponential(double u, double k, double h) {
  if (!(k * h > 1e-14)) return u * h;
  return std::min(h, -std::log1p(u * std::expm1(-k * h)) / k);
}

// Where a ray is in a grid, by distance from the ray's origin: in a cell, in front of the grid, or past it.
class Steps {
 public:
  Steps(const Grid& grid, const V3& o, const V3& d, float t_max) : walk_(grid, o, d, 0, t_max) {
    more_ = walk_.next();
    if (!more_) return;
    const V3 v = walk_.direction();
    longest_ = kStretchVoxels / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  void advance(double at) {
    while (more_ && end() <= at) more_ = walk_.next();
  }
  bool past() const { return !more_; }
  bool inside(double at) const { return more_ && begin() <= at; }
  // Where the next cell begins, or this one ends.
  double boundary(double at) const { return !more_ ? kInf : begin() <= at ? end() : begin(); }
  double longest() const { return longest_; }
  const MacroCell& cell() const { return walk_.cell(); }
  // Distance as the grid's own functions know it.
  float local(double t) const { return static_cast<float>(t - walk_.entry()); }
  double distance(float local) const { return walk_.entry() + local; }
  V3 index(double t) const { return walk_.index(local(t)); }
  Passage pass(const Grid& grid, double a, double b, double wanted = kInf) const {
    return grid.pass(walk_.origin(), walk_.direction(), local(a), local(b), wanted);
  }

 private:
  double begin() const { return walk_.entry() + walk_.begin(); }
  double end() const { return walk_.entry() + walk_.end(); }

  CellWalk walk_;
  bool more_ = false;
  double longest_ = kInf;
};

class GlowWalk {
 public:
  GlowWalk(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream)
      : m_(m),
        o_(o),
        d_(d),
        end_(t_max),
        stream_(stream),
        density_(*m.density, o, d, t_max),
        channels_(m.chromatic() ? 3 : 1),
        s_max_(max_component(m.sigma_t)),
        left_(stream_.exponential()) {
    if (m.emitter[0]) emitter_.emplace(*m.emitter[0], o, d, t_max);
  }

  C3 run() {
    for (double at = 0; at < end_;) {
      density_.advance(at);
      if (emitter_) emitter_->advance(at);
      if ((emitter_ && emitter_->past()) || (m_.glow != Glow::per_length && density_.past())) break;
      double to = std::min(end_, density_.boundary(at));
      if (emitter_) to = std::min(to, emitter_->boundary(at));
      const MacroCell* cell = density_.inside(at) ? &density_.cell() : nullptr;
      const bool absorbs = cell && s_max_ * cell->hi > 0, shines = may_shine(at, cell);
      if (shines && absorbs) {
        to = std::min(to, at + density_.longest());
        if (emitter_) to = std::min(to, at + emitter_->longest());
      }
      if (!absorbs) {
        if (shines) add_unabsorbed(at, to);
      } else if (s_max_ * cell->residual * (to - at) > detail::kExactDepth) {
        pass_exactly(at, to, shines);
      } else {
        track(at, to, *cell, shines);
      }
      if (!goes_on()) break;
      at = to;
    }
    return C3(sum_);
  }

 private:
  bool may_shine(double at, const MacroCell* cell) const {
    if (m_.glow != Glow::per_length && !(cell && cell->hi > 0)) return false;
    if (!emitter_) return true;
    if (!emitter_->inside(at)) return false;
    // Of several channels only the first one's bound is at hand.
    if (m_.emitter[1] != m_.emitter[0]) return true;
    const float hi = emitter_->cell().hi;
    return m_.glow == Glow::black_body ? m_.kelvin_offset + m_.kelvin_scale * hi >= kColdest : hi > 0;
  }

  // Radiance given off per length at t.
  V3d emitted(double t) const {
    V3d e(m_.emission);
    if (emitter_) {
      const V3 q = emitter_->index(t);
      if (m_.glow == Glow::black_body)
        e = e *
            V3d(black_body_radiance(m_.kelvin_offset + m_.kelvin_scale * m_.emitter[0]->value_anywhere(q)));
      else
        for (int c = 0; c < 3; ++c) e[c] *= m_.emitter[c]->value_anywhere(q);
    }
    if (m_.glow == Glow::per_length) return e;
    const C3 scattering = m_.scattering_at(o_ + d_ * static_cast<float>(t));
    const double rho = density_at(t);
    for (int c = 0; c < 3; ++c) e[c] *= rho * std::max(0.f, m_.sigma_t[c] - scattering[c]);
    return e;
  }
  double density_at(double t) const { return m_.density->value_anywhere(density_.index(t)); }

  // The light e of channel c (or of all of them, where they are treated alike), times a share of it.
  void add(int c, const V3d& e, double share) {
    if (channels_ == 1) {
      sum_ = sum_ + e * (through_[0] * share);
    } else {
      sum_[c] += e[c] * (through_[c] * share);
    }
  }

  // Only light per length is given off here. The integral of a grid is known; of one value, too.
  void add_unabsorbed(double a, double b) {
    V3d e(m_.emission);
    for (int c = 0; c < 3; ++c) {
      const double field = !emitter_ ? b - a
                           : c > 0 && m_.emitter[c] == m_.emitter[c - 1]
                               ? sum_of_last_
                               : emitter_->pass(*m_.emitter[c], a, b).integral;
      sum_of_last_ = field;
      // A dark channel stays dark, however far.
      if (e[c] > 0) sum_[c] += e[c] * through_[channels_ == 1 ? 0 : c] * field;
    }
  }

  void track(double a, double b, const MacroCell& cell, bool shines) {
    const double h = b - a;
    const float rate = s_max_ * cell.residual, room = rate * static_cast<float>(h);
    double where[3], factor[3] = {1, 1, 1};
    bool due[3] = {shines, shines && channels_ > 1, shines && channels_ > 1};
    if (shines) {
      const double u = stream_.uniform();
      for (int c = 0; c < channels_; ++c)
        where[c] = truncated_exponential(u, double{m_.sigma_t[c]} * cell.control, h);
    }
    float gone = left_;
    for (;; gone += stream_.exponential()) {
      const bool collides = gone < room;
      const double t = collides ? std::min(h, double{gone} / rate) : h;
      for (int c = 0; c < channels_; ++c) {
        if (!due[c] || where[c] > t) continue;
        due[c] = false;
        const double k = double{m_.sigma_t[c]} * cell.control;
        add(c, emitted(a + where[c]), factor[c] * h * mean_transmittance(k * h));
      }
      if (!collides) break;
      const double r = (density_at(a + t) - cell.control) / cell.residual;
      for (int c = 0; c < channels_; ++c) factor[c] *= std::max(0., 1 - r * m_.sigma_t[c] / s_max_);
    }
    left_ = gone - room;
    for (int c = 0; c < channels_; ++c)
      through_[c] *= factor[c] * std::exp(-double{m_.sigma_t[c]} * cell.control * h);
  }

  // Where trackers would collide too often: the field's own integral, and two samples weighed by the balance
  // heuristic, one uniform and one where light is absorbed. So emission is found in the gaps of a dense cell,
  // and at its surface.
  void pass_exactly(double a, double b, bool shines) {
    const double h = b - a, whole = density_.pass(*m_.density, a, b).integral;
    if (shines) {
      const double u = stream_.uniform(), v = stream_.uniform();
      for (int c = 0; c < channels_; ++c) {
        const double s = m_.sigma_t[c], absorbed = -std::expm1(-s * whole);
        const auto add_at = [&](double t, double depth) {
          const double rest = std::exp(-s * depth);
          add(c, emitted(t), rest / (1 / h + (absorbed > 0 ? s * density_at(t) * rest / absorbed : 0)));
        };
        const double t = a + u * h;
        add_at(t, density_.pass(*m_.density, a, t).integral);
        if (!(absorbed > 0)) continue;
        const double wanted = -std::log1p(-v * absorbed) / s;
        const Passage p = density_.pass(*m_.density, a, b, wanted);
        add_at(p.reached ? density_.distance(p.t) : b, p.reached ? wanted : whole);
      }
    }
    for (int c = 0; c < channels_; ++c) through_[c] *= std::exp(-m_.sigma_t[c] * whole);
  }

  // Roulette, as for transmittances.
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
  const int channels_;  // 1: all have the same extinction
  const float s_max_;
  float left_;  // of the residuals' depth, up to the next collision
  double through_[3] = {1, 1, 1};
  double sum_of_last_ = 0;
  V3d sum_{0, 0, 0};
};

}  // namespace

C3 glow_of_length(const Medium& m, float t_max) {
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

C3 glow_of_grid(const Medium& m, const V3& o, const V3& d, float t_max, RandomStream stream) {
  return GlowWalk(m, o, d, t_max, stream).run();
}

}  // namespace ls::render
