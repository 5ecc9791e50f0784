#include "core/image/error/convergence.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/image/error/area_error.h"
#include "core/image/frame/rounds.h"

namespace ls {
namespace {

// Points with fewer samples per pixel than this are not used: each half of the samples would have only one or
// two per pixel and be too noisy.
constexpr double kLeastSpp = 8;
constexpr double kPriorSpread = .15;
// The standard deviation of the slope's change per square root of log time, for forecasts; it is b in
// convergence.h.
constexpr double kBend = .06;
// The verdict is "slower" if the whole interval of the slope is below kSlow, and "faster" if it is above
// kFast.
constexpr double kSlow = .85, kFast = 1.1;
// The line is fitted to at most this many points, at doubling sample counts.
constexpr std::size_t kMostPoints = 32;

struct Log {
  double time = 0, error = 0, spp = 0;
  double sigma = 0;  // standard deviation of `error`, which is log(relMSE)
};

bool usable(const ErrorPoint& p) {
  return p.spp >= kLeastSpp && p.core_seconds > 0 && p.relmse > 0 && p.relmse_lo > 0 &&
         p.relmse_hi > p.relmse_lo && std::isfinite(p.relmse_hi) && std::isfinite(p.core_seconds);
}

Log log_of(const ErrorPoint& p) {
  const double interval = std::log(p.relmse_hi / p.relmse_lo) / (2 * kNormal95);
  return {std::log(p.core_seconds), std::log(p.relmse), p.spp, interval * std::sqrt(.5)};
}

// Selects the usable points at doubling sample counts, and returns their logarithms in order of samples: the
// last usable point, and before it always the latest point that has at most half the samples of its
// successor.
std::vector<Log> doublings(std::span<const ErrorPoint> points) {
  std::vector<Log> out;
  for (std::size_t i = points.size(); i-- > 0 && out.size() < kMostPoints;) {
    if (!usable(points[i])) continue;
    if (out.empty() || 2 * points[i].spp <= out.back().spp) out.push_back(log_of(points[i]));
  }
  std::reverse(out.begin(), out.end());
  return out;
}

double covariance(const Log& a, const Log& b) {
  return a.sigma * b.sigma * std::min(a.spp, b.spp) / std::max(a.spp, b.spp);
}

// Returns the covariance that a varying slope adds to the errors at the log times u and v. u and v are
// measured from a reference point of the line. The slope follows a Brownian motion of variance 1 per unit of
// log time. Errors on different sides of the reference point are independent.
double bend_covariance(double u, double v) {
  if (u * v <= 0) return 0;
  const double near = std::min(std::abs(u), std::abs(v)), far = std::max(std::abs(u), std::abs(v));
  return near * near * (3 * far - near) / 6;
}

// Returns L, the lower Cholesky factor of the covariance of the points' errors. This covariance includes that
// of a varying slope, which is bend^2 times bend_covariance() with the last point as the reference point.
// `bend` is the standard deviation of the slope's change per square root of log time, like kBend; 0: the
// slope is constant. nullopt: the covariance is not positive definite.
using Matrix = std::array<std::array<double, kMostPoints>, kMostPoints>;
std::optional<Matrix> factor(const std::vector<Log>& y, double bend) {
  Matrix l{};
  const auto from_last = [&](std::size_t i) { return y[i].time - y.back().time; };
  for (std::size_t i = 0; i < y.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = covariance(y[i], y[j]) + bend * bend * bend_covariance(from_last(i), from_last(j));
      for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j && !(sum > 0)) return std::nullopt;
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
  }
  return l;
}

// Returns L^-1 times the vector that has the component value(p) for each point p, where `l` is L, the result
// of factor(). After this transformation the errors of the points are independent and have the variance 1.
template <class Value>
std::vector<double> whitened(const Matrix& l, const std::vector<Log>& y, const Value& value) {
  std::vector<double> out(y.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    double sum = value(y[i]);
    for (std::size_t k = 0; k < i; ++k) sum -= l[i][k] * out[k];
    out[i] = sum / l[i][i];
  }
  return out;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// The line log(relMSE) = level - slope * log(core seconds), fitted by generalised least squares; `l` is the
// Cholesky factor of the points' covariance. The slope has a Gaussian prior of mean 1 and variance 1 /
// prior_weight; prior_weight 0 means no prior. Log times are measured from the last point, which makes level
// and slope nearly independent.
class Line {
 public:
  Line(const std::vector<Log>& points, const Matrix& l, double prior_weight, double bend)
      : y_(points),
        l_(l),
        bend_(bend),
        one_(whitened(l, y_, [](const Log&) { return 1.; })),
        time_(whitened(l, y_, [&](const Log& p) { return y_.back().time - p.time; })),
        error_(whitened(l, y_, [](const Log& p) { return p.error; })) {
    const double m11 = product(one_, one_), m12 = product(one_, time_),
                 m22 = product(time_, time_) + prior_weight;
    determinant_ = m11 * m22 - m12 * m12;
    v11_ = m22 / determinant_, v12_ = -m12 / determinant_, v22_ = m11 / determinant_;
    const double r1 = product(one_, error_),
                 r2 = product(time_, error_) + prior_weight;  // prior_weight times the prior's mean, 1
    level_ = v11_ * r1 + v12_ * r2;
    slope_ = v12_ * r1 + v22_ * r2;
  }
  bool sound() const { return determinant_ > 0 && std::isfinite(v22_) && v22_ > 0; }
  double slope() const { return slope_; }
  double slope_sigma() const { return std::sqrt(v22_); }

  struct Value {
    double mean = 0, sigma = 0;
  };
  // Predicts the logarithm of the estimated error when the number of samples is exp(later) times that of the
  // last point. The prediction is the value of the line, plus a part of the points' deviations from the line:
  // this part persists because later checkpoints contain the samples of the earlier ones (Rasmussen and
  // Williams 2006, section 2.7).
  Value at(double later) const {
    const Log then{0, 0, y_.back().spp * std::exp(later), y_.back().sigma};
    const auto shared = whitened(l_, y_, [&](const Log& p) { return covariance(p, then); });
    const double f1 = 1 - product(one_, shared), f2 = -later - product(time_, shared);
    const double mean = level_ - slope_ * later + product(shared, error_) - level_ * product(one_, shared) -
                        slope_ * product(time_, shared);
    const double variance = then.sigma * then.sigma - product(shared, shared) + f1 * f1 * v11_ +
                            2 * f1 * f2 * v12_ + f2 * f2 * v22_ +
                            bend_ * bend_ * bend_covariance(later, later);
    return {mean, std::sqrt(std::max(0., variance))};
  }

 private:
  const std::vector<Log>& y_;
  const Matrix& l_;
  double bend_;
  std::vector<double> one_, time_, error_;
  double determinant_ = 0, v11_ = 0, v12_ = 0, v22_ = 0, level_ = 0, slope_ = 0;
};

std::string words(double lo, double hi) {
  if (hi < kSlow)
    return "slower than 1/N: rare bright samples are still being found, so the error is larger than it looks";
  return lo > kFast ? "faster than 1/N" : "converging as expected";
}

double excess(const ErrorPoint& p) { return *p.true_relmse - p.relmse; }

// Tests the two conditions of a bias floor (convergence.h): the true error of the last point exceeds the
// estimated one by more than chance, and this excess falls too slowly.
bool stands_on_a_floor(std::span<const ErrorPoint> points) {
  constexpr double kSigmas = 4;
  if (points.empty() || !usable(points.back()) || !points.back().true_relmse) return false;
  const ErrorPoint& now = points.back();
  if (!(*now.true_relmse > 0)) return false;
  const double sigma = std::log(now.relmse_hi / now.relmse_lo) / (2 * kNormal95);
  const double by_estimate = now.relmse * std::expm1(kSigmas * sigma);
  const double by_reference = kSigmas * now.true_stderr.value_or(0);
  if (excess(now) < std::hypot(by_estimate, by_reference)) return false;
  for (std::size_t i = points.size() - 1; i-- > 0;) {
    const ErrorPoint& before = points[i];
    if (!usable(before) || !before.true_relmse || 2 * before.spp > now.spp) continue;
    return excess(now) > excess(before) * std::sqrt(before.spp / now.spp);
  }
  return false;
}

// Returns the log time at which value(log time) has fallen to `wanted`. Log time is measured from the last
// point; the result is at least 0.
template <class Curve>
double when(const Curve& value, double wanted) {
  constexpr double kMost = 60;  // log times beyond this, e^60 times the time so far, count as never
  double lo = 0, hi = 1;
  while (hi < kMost && value(hi) > wanted) lo = hi, hi *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (lo + hi) / 2;
    (value(middle) > wanted ? lo : hi) = middle;
  }
  return hi;
}

// Returns the number of samples at the end of the round that contains sample `spp`.
double end_of_round(double spp) {
  if (!(spp < 0x1p52)) return spp;
  const auto samples = static_cast<std::uint64_t>(std::ceil(spp));
  return static_cast<double>(round_range(round_count(samples) - 1).s1);
}

// Returns how much the cost of a sample (CPU time per sample) varies: the root mean square of relative
// differences. For each of the last few doublings of the number of samples, the cost of the samples in this
// doubling is compared with the mean cost of all samples so far. 0: there are too few points.
double cost_spread(std::span<const ErrorPoint> points) {
  constexpr int kDoublings = 4;
  const ErrorPoint& now = points.back();
  const ErrorPoint* later = &now;
  double squares = 0;
  int count = 0;
  for (std::size_t i = points.size() - 1; i-- > 0 && count < kDoublings;) {
    const ErrorPoint& p = points[i];
    if (2 * p.spp > later->spp || !(p.spp > 0) || !(p.core_seconds > 0)) continue;
    const double cost = (later->core_seconds - p.core_seconds) / (later->spp - p.spp);
    const double off = cost * now.spp / now.core_seconds - 1;
    squares += off * off;
    ++count;
    later = &p;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

}  // namespace

std::optional<Trend> trend_of(std::span<const ErrorPoint> points) {
  const std::vector<Log> y = doublings(points);
  if (y.size() < 3) return std::nullopt;
  const auto l = factor(y, 0);
  if (!l) return std::nullopt;
  const Line line(y, *l, 0, 0);
  if (!line.sound()) return std::nullopt;
  const double half = kNormal95 * line.slope_sigma(), lo = line.slope() - half, hi = line.slope() + half;
  return Trend{static_cast<int>(y.size()), line.slope(), lo, hi, words(lo, hi)};
}

const char* to_string(ConvergenceStatus::Kind kind) {
  static constexpr const char* kNames[] = {"early", "converging", "fast", "heavy_tail", "bias_floor"};
  return kNames[static_cast<std::size_t>(kind)];
}

ConvergenceStatus judge(std::span<const ErrorPoint> points, const std::string& doubt) {
  using Kind = ConvergenceStatus::Kind;
  const auto trend = trend_of(points);
  if (!doubt.empty()) return {trend ? Kind::heavy_tail : Kind::early, doubt, false};
  if (stands_on_a_floor(points))
    return {
        Kind::bias_floor,
        fmt::format("bias floor: the true relMSE stays near {:.2g} while the estimated one falls to {:.2g}: "
                    "image and reference do not agree{}",
                    *points.back().true_relmse, points.back().relmse,
                    points.back().true_stderr ? ", by more than the noise of both"
                                              : ", or the reference is noisy and brings no error of its own"),
        false};
  if (!trend) return {Kind::early, "too early to tell how it converges"};
  if (trend->slope_hi < kSlow) return {Kind::heavy_tail, "don't trust yet: " + trend->verdict, false};
  return {trend->slope_lo > kFast ? Kind::fast : Kind::converging, trend->verdict};
}

std::optional<Forecast> forecast_of(std::span<const ErrorPoint> points, double target) {
  if (points.empty() || !(target > 0) || !usable(points.back())) return std::nullopt;
  const ErrorPoint& now = points.back();
  if (now.relmse <= target) return Forecast{now.spp, 0, 0, 0};
  const std::vector<Log> y = doublings(points);
  const auto l = factor(y, kBend);
  if (!l) return std::nullopt;
  const Line line(y, *l, 1 / (kPriorSpread * kPriorSpread), kBend);
  if (!line.sound()) return std::nullopt;
  const auto reached = [&](double sigmas) {
    return std::exp(when(
        [&](double later) {
          const Line::Value v = line.at(later);
          return v.mean + sigmas * v.sigma;
        },
        std::log(target)));
  };
  const auto spp = [&](double times) { return end_of_round(now.spp * times); };
  const auto left = [&](double samples) { return now.core_seconds * (samples / now.spp - 1); };
  const double best = spp(reached(0)), costs = 1 + kNormal95 * cost_spread(points);
  return Forecast{best, left(best), left(now.spp * reached(-kNormal95)) / costs,
                  left(spp(reached(kNormal95))) * costs};
}

}  // namespace ls
