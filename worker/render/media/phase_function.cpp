#include "worker/render/media/phase_function.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/base/overloaded.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/media/grid.h"

namespace ls::render {
namespace {

// Returns the root of an increasing function in [low, high], from a first guess. f(t) returns the function
// and its derivative. Newton's steps that leave the interval in which the root is known to lie are replaced
// by bisection.
template <class F>
double root(double low, double high, double t, const F& f) {
  constexpr int kMostSteps = 100;  // bisection alone halves the interval to nothing in about 60
  constexpr double kEnough = 1e-14;
  for (int i = 0; i < kMostSteps; ++i) {
    const auto [value, slope] = f(t);
    if (value == 0) return t;
    (value < 0 ? low : high) = t;
    double next = t - value / slope;
    if (!(next > low && next < high)) next = .5 * (low + high);
    const double step = std::abs(next - t);
    t = next;
    if (step <= kEnough * std::max(1., std::abs(t))) break;
  }
  return t;
}

struct PointOnCurve {
  double value, slope;
};

// Returns the angle as it is seen from the peak of a function with the mean cosine g.
ScatteringAngle from_peak(double g, const ScatteringAngle& angle) {
  return g >= 0 ? angle : ScatteringAngle{angle.y, angle.x};
}

// The integral of the squared cosine of Henyey-Greenstein's function with the parameter a = |g| over the
// random numbers 0 to s of its inversion (HenyeyGreensteinLobe::sample).
double squared_cosines(double a, double s) {
  constexpr double kSmall = .05;  // the closed form loses a factor 1 / (4 a^2) of precision
  if (a >= kSmall) {
    const double r = (1 - a) / (1 - a + 2 * a * s), b = (1 + a) * (1 + a), q = 1 + a * a;
    return s * (q * q - 2 * q * b * r + b * b * r * (1 + r + r * r) / 3) / (4 * a * a);
  }
  // Gauss's rule with five nodes. With a = 0 the integrand is a polynomial of degree 2; the error is of the
  // order a^8.
  constexpr double kNode[] = {0, .5384693101056831, .9061798459386640};
  constexpr double kWeight[] = {.5688888888888889, .4786286704993665, .2369268850561891};
  const auto at = [&](double t) {
    const double d = 1 - a + 2 * a * t, c = 1 - 2 * sqr((1 - a) / d) * (1 - t) * (1 + a * t);
    return c * c;
  };
  double sum = kWeight[0] * at(.5 * s);
  for (int i = 1; i < 3; ++i) sum += kWeight[i] * (at(.5 * s * (1 - kNode[i])) + at(.5 * s * (1 + kNode[i])));
  return .5 * s * sum;
}

}  // namespace

double HenyeyGreensteinLobe::density(const ScatteringAngle& angle) const {
  const double a = std::abs(g), s = sqr(1 - a) + 2 * a * from_peak(g, angle).x;
  return (1 - a) * (1 + a) / (4 * kPiD * s * std::sqrt(s));
}

ScatteringAngle HenyeyGreensteinLobe::sample(double u) const {
  const double a = std::abs(g), d = (1 - a) * (1 - u) + (1 + a) * u, scale = 2 / (d * d);
  return from_peak(g, {scale * sqr(1 - a) * (1 - u) * (1 + a * u), scale * sqr(1 + a) * u * (1 - a + a * u)});
}

double RayleighLobe::density(const ScatteringAngle& angle) const {
  return 3 / (16 * kPiD) * (1 + sqr(angle.cosine()));
}

ScatteringAngle RayleighLobe::sample(double u) const {
  // The share below the cosine c is (c^3 + 3 c + 4) / 8. Cardano's root of c^3 + 3 c = 2 h, with the sum of
  // two numbers of the same sign under the cube root.
  const double h = 4 * u - 2, t = std::cbrt(std::abs(h) + std::sqrt(h * h + 1));
  const double c = std::clamp(std::copysign(t - 1 / t, h), -1., 1.);
  return {1 - c, 1 + c};
}

double DraineLobe::density(const ScatteringAngle& angle) const {
  return HenyeyGreensteinLobe{g}.density(angle) * (1 + alpha * sqr(angle.cosine())) /
         (1 + alpha * (1 + 2 * g * g) / 3);
}

// The paper of Jendersie and d'Eon inverts the distribution by the roots of a quartic, which divide by g and
// by alpha. Here the unknown is the random number s with which Henyey-Greenstein's function has the angle:
// the distribution is smooth and increasing in s for all parameters.
ScatteringAngle DraineLobe::sample(double u) const {
  const double a = std::abs(g), whole = 1 + alpha * (1 + 2 * g * g) / 3;
  const HenyeyGreensteinLobe hg{g};
  const double s = root(0, 1, u, [&](double t) {
    return PointOnCurve{(t + alpha * squared_cosines(a, t)) / whole - u,
                        (1 + alpha * sqr(hg.sample(t).cosine())) / whole};
  });
  return hg.sample(s);
}

DropletLobe DropletLobe::of_diameter(double d) {
  DropletLobe p;
  if (d >= 5) {
    p.peak.g = std::exp(-.0990567 / (d - 1.67154));
    p.rest.g = std::exp(-2.20679 / (d + 3.91029) - .428934);
    p.rest.alpha = std::exp(3.62489 - 8.29288 / (d + 5.52825));
    p.draine_share = std::exp(-.599085 / (d - .641583) - .665888);
    return p;
  }
  const double l = std::log(d);
  if (d >= 1.5) {
    p.peak.g = .0604931 * std::log(l) + .940256;
    p.rest.g = .500411 - .081287 / (-2 * l + std::tan(l) + 1.27551);
    p.rest.alpha = 7.30354 * l + 6.31675;
    p.draine_share = .026914 * (l - std::cos(5.68947 * (std::log(l) - .0292149))) + .376475;
  } else if (d > .1) {
    p.peak.g = .862 - .143 * l * l;
    p.rest.g = .379685 * std::cos(1.19692 * std::cos((l - .238604) * (l + 1.00667) / (.507522 - .15677 * l)) +
                                  1.37932 * l + .0625835) +
               .344213;
    p.rest.alpha = 250;
    p.draine_share = .146209 * std::cos(3.38707 * l + 2.11193) + .316072 + .0778917 * l;
  } else {
    p.peak.g = 13.8 * d * d;
    p.rest.g = 1.1456 * d * std::sin(9.29044 * d);
    p.rest.alpha = 250;
    p.draine_share = .252977 - 312.983 * std::pow(d, 4.3);
  }
  return p;
}

double DropletLobe::density(const ScatteringAngle& angle) const {
  return (1 - draine_share) * peak.density(angle) + draine_share * rest.density(angle);
}

ScatteringAngle DropletLobe::sample(double u) const {
  return u < draine_share ? rest.sample(u / draine_share)
                          : peak.sample((u - draine_share) / (1 - draine_share));
}

FournierForandLobe::FournierForandLobe(double backscatter, double ior) : delta_of_x_(2 / (3 * sqr(ior - 1))) {
  // backscatter = (delta^power - 1) / (delta - 1) / 2 at 90 degrees, where delta is delta_of_x_
  const double e = delta_of_x_ - 1;
  power_ = e == 0 ? 2 * backscatter : std::log1p(2 * backscatter * e) / std::log1p(e);
  const double back = 2 * e + 1;
  at_back_ = back == 0 ? power_ : std::expm1(power_ * std::log1p(back)) / back;
  peak_ = share(kLeast).below;
}

// The distribution of Fournier and Jonasz is 1 - (1 - x / 2) R + at_back_ / 8 c (1 - c^2), with
// R = (delta^power - 1) / (delta - 1).
FournierForandLobe::Share FournierForandLobe::share(double x) const {
  const double m = power_, delta = delta_of_x_ * x, e = delta - 1, c = 1 - x;
  double r, slope;  // R and its derivative by delta
  if (std::abs(e) < 1e-3) {
    // Taylor series about delta = 1; the first omitted terms are below 1e-12 and 1e-9
    r = m * (1 + (m - 1) * e / 2 * (1 + (m - 2) * e / 3 * (1 + (m - 3) * e / 4)));
    slope = m * (m - 1) / 2 * (1 + (m - 2) * e * (2. / 3 + (m - 3) * e / 4));
  } else {
    const double q = std::expm1(m * std::log(delta));
    r = q / e;
    slope = (m * (q + 1) / delta - r) / e;
  }
  return {1 - (1 - x / 2) * r + at_back_ / 8 * c * x * (2 - x),
          r / 2 - (1 - x / 2) * delta_of_x_ * slope + at_back_ / 8 * (3 * c * c - 1)};
}

double FournierForandLobe::density(const ScatteringAngle& angle) const {
  return (angle.x < kLeast ? peak_ / kLeast : share(angle.x).slope) / (2 * kPiD);
}

ScatteringAngle FournierForandLobe::sample(double u) const {
  if (u < peak_) {
    const double x = u / peak_ * kLeast;
    return {x, 2 - x};
  }
  // The unknown is ln x, since the angles span many orders of magnitude
  const double low = std::log(kLeast), high = std::log(2.);
  const double x = std::exp(root(low, high, .5 * (low + high), [&](double t) {
    const double at = std::exp(t);
    const Share s = share(at);
    return PointOnCurve{s.below - u, s.slope * at};
  }));
  return {std::min(x, 2.), std::max(0., 2 - x)};
}

TabulatedLobe::TabulatedLobe(std::span<const double> cosines, std::span<const std::vector<double>> values) {
  const std::size_t n = cosines.size();
  CHECK(n >= 2 && (values.size() == 1 || values.size() == 3), "a phase function of {} values in {} colours",
        n, values.size());
  x_.resize(n);
  for (std::size_t i = 0; i < n; ++i) x_[i] = 1 - cosines[n - 1 - i];
  for (const std::vector<double>& given : values) {
    Colour& c = colours_.emplace_back();
    c.value.assign(given.rbegin(), given.rend());
    // So that no sum of small values is zero
    const double most = std::ranges::max(c.value);
    for (double& v : c.value) v /= most;
    c.below.resize(n);
    for (std::size_t i = 1; i < n; ++i)
      c.below[i] = c.below[i - 1] + .5 * (x_[i] - x_[i - 1]) * (c.value[i - 1] + c.value[i]);
    const double whole = c.below[n - 1];
    for (double& b : c.below) b /= whole;
    for (double& v : c.value) v /= 2 * kPiD * whole;
  }
}

// Returns i so that x is in [x_[i], x_[i + 1]].
std::size_t TabulatedLobe::cell_of(double x) const {
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  return static_cast<std::size_t>(above - x_.begin()) - 1;
}

double TabulatedLobe::at(const Colour& c, std::size_t i, double x) const {
  const double t = std::clamp((x - x_[i]) / (x_[i + 1] - x_[i]), 0., 1.);
  return (1 - t) * c.value[i] + t * c.value[i + 1];
}

C3 TabulatedLobe::value(const ScatteringAngle& angle) const {
  const double x = 1 - angle.cosine();
  const std::size_t i = cell_of(x);
  if (colours_.size() == 1) return C3(static_cast<float>(at(colours_[0], i, x)));
  return {static_cast<float>(at(colours_[0], i, x)), static_cast<float>(at(colours_[1], i, x)),
          static_cast<float>(at(colours_[2], i, x))};
}

double TabulatedLobe::density(const ScatteringAngle& angle) const {
  const double x = 1 - angle.cosine();
  const std::size_t i = cell_of(x);
  double sum = 0;
  for (const Colour& c : colours_) sum += at(c, i, x);
  return sum / static_cast<double>(colours_.size());
}

ScatteringAngle TabulatedLobe::sample(double u) const {
  const auto colours = static_cast<double>(colours_.size());
  const auto which = std::min(colours_.size() - 1, static_cast<std::size_t>(u * colours));
  const Colour& c = colours_[which];
  const double wanted = std::max(0., u * colours - static_cast<double>(which));
  // The cell in which the share passes `wanted`: no cell without light, unless rounding puts `wanted` at the
  // end of all light
  const auto above = std::upper_bound(c.below.begin(), c.below.end() - 1, wanted);
  std::size_t i = static_cast<std::size_t>(above - c.below.begin());
  while (i > 1 && !(c.below[i] > c.below[i - 1])) --i;
  --i;
  const double width = x_[i + 1] - x_[i], v0 = c.value[i], v1 = c.value[i + 1];
  // With t in [0, 1] across the cell, v0 t + (v1 - v0) t^2 / 2 = r; this form of the root has no cancellation
  const double r = (wanted - c.below[i]) / (2 * kPiD * width);
  const double t = r > 0 ? 2 * r / (v0 + safe_sqrt(v0 * v0 + 2 * (v1 - v0) * r)) : 0;
  const double x = std::clamp(x_[i] + std::min(t, 1.) * width, 0., 2.);
  return {x, 2 - x};
}

namespace {

float weight_at(const BlendedLobes& b, const V3& p) {
  return b.grid ? std::min(1.f, b.grid->value_anywhere(b.grid->to_index(p))) : b.weight;
}

}  // namespace

void PhaseFunctions::add_value(std::uint32_t which, const V3& p, const ScatteringAngle& angle, float share,
                               Value& sum) const {
  const auto add = [&](const C3& value, double density) {
    sum.value += value * share;
    sum.pdf += static_cast<float>(density) * share;
  };
  std::visit(overloaded{[&](const BlendedLobes& b) {
                          const float second = weight_at(b, p);
                          if (second < 1) add_value(b.first, p, angle, share * (1 - second), sum);
                          if (second > 0) add_value(b.second, p, angle, share * second, sum);
                        },
                        [&](const TabulatedLobe& t) { add(t.value(angle), t.density(angle)); },
                        [&](const auto& one) {
                          const double density = one.density(angle);
                          add(C3(static_cast<float>(density)), density);
                        }},
             kinds_[which]);
}

ScatteringAngle PhaseFunctions::sample_angle(std::uint32_t which, const V3& p, double u) const {
  return std::visit(overloaded{[&](const BlendedLobes& b) {
                                 const double second = double{weight_at(b, p)};
                                 return u < second ? sample_angle(b.second, p, u / second)
                                                   : sample_angle(b.first, p, (u - second) / (1 - second));
                               },
                               [&](const auto& one) { return one.sample(u); }},
                    kinds_[which]);
}

PhaseFunctions::Value PhaseFunctions::value(std::uint32_t which, const V3& p, const V3& w,
                                            const V3& w1) const {
  LS_COUNT(phase);
  Value sum;
  add_value(which, p, ScatteringAngle::between(w, w1), 1, sum);
  return sum;
}

PhaseFunctions::Sample PhaseFunctions::sample(std::uint32_t which, const V3& p, const V3& w, V2 u) const {
  LS_COUNT(phase);
  const ScatteringAngle angle = sample_angle(which, p, double{u.x});
  const V2 around = unit_circle(u.y) * static_cast<float>(safe_sqrt(angle.x * angle.y));
  Sample s;
  s.w = normalize(Frame(w).to_world({around.x, around.y, static_cast<float>(angle.cosine())}));
  add_value(which, p, angle, 1, s.of);
  return s;
}

void PhaseFunctions::find_mean_cosines() {
  mean_cosines_.assign(kinds_.size(), std::nullopt);
  for (std::uint32_t i = 0; i < kinds_.size(); ++i) find_mean_cosine(i);
}

// Each is computed once, however many blends contain it.
double PhaseFunctions::find_mean_cosine(std::uint32_t which) {
  if (mean_cosines_[which]) return *mean_cosines_[which];
  const double found = std::visit(overloaded{[&](const BlendedLobes& b) {
                                               const double second = b.grid ? .5 : double{b.weight};
                                               return (1 - second) * find_mean_cosine(b.first) +
                                                      second * find_mean_cosine(b.second);
                                             },
                                             [](const HenyeyGreensteinLobe& one) { return one.g; },
                                             [](const auto& one) {
                                               constexpr int kQuantiles = 1024;
                                               double sum = 0;
                                               for (int i = 0; i < kQuantiles; ++i)
                                                 sum += one.sample((i + .5) / kQuantiles).cosine();
                                               return sum / kQuantiles;
                                             }},
                                  kinds_[which]);
  mean_cosines_[which] = found;
  return found;
}

}  // namespace ls::render
