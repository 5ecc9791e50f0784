#include "cli/validate_stats.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ls::cli {
namespace {

constexpr double kTiny = 1e-300;  // stands for a 0 that would be divided by
constexpr double kPrecision = 1e-15;
constexpr double kFarOut = 1e12;  // no quantile is looked for beyond
constexpr int kMostTerms = 100'000;

// 1 / (b0 + a1 / (b1 + a2 / (b2 + ...))) by the method of Lentz; step(i) gives {a_i, b_i}, b0 = b(0).
template <class Step>
double continued_fraction(double b0, Step step) {
  double f = b0 == 0 ? kTiny : b0, c = f, d = 0;
  for (int i = 1; i < kMostTerms; ++i) {
    const auto [a, b] = step(i);
    d = b + a * d;
    if (d == 0) d = kTiny;
    c = b + a / c;
    if (c == 0) c = kTiny;
    d = 1 / d;
    const double factor = c * d;
    f *= factor;
    if (std::abs(factor - 1) < kPrecision) break;
  }
  return 1 / f;
}

struct Step {
  double a, b;
};

// The regularised incomplete beta function (DLMF 8.17.22; by symmetry where that converges slowly).
double beta_ratio(double a, double b, double x) {
  if (!(x > 0)) return 0;
  if (!(x < 1)) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - beta_ratio(b, a, 1 - x);
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x)) /
      a;
  return front * continued_fraction(1, [&](int i) {
           const int m = i / 2;
           const double term = i % 2 == 0 ? m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
                                          : -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
           return Step{term, 1};
         });
}

// Q(a, x), the regularised upper incomplete gamma function: DLMF 8.9.2, or 1 minus the series 8.11.4.
double gamma_tail(double a, double x) {
  if (!(x > 0)) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double sum = 1 / a, term = sum;
    for (int n = 1; n < kMostTerms && term > kPrecision * sum; ++n) sum += term *= x / (a + n);
    return std::max(0., 1 - front * sum);
  }
  return front * continued_fraction(x + 1 - a, [&](int i) { return Step{-i * (i - a), x + 2 * i + 1 - a}; });
}

}  // namespace

double sidak(double level, std::size_t n) {
  return -std::expm1(std::log1p(-level) / static_cast<double>(std::max<std::size_t>(n, 1)));
}

double student_tails(double t, double freedom) {
  if (std::isnan(t)) return 0;
  if (std::isinf(t)) return 0;
  return beta_ratio(freedom / 2, .5, freedom / (freedom + t * t));
}

double student_quantile(double p, double freedom) {
  double lo = 0, hi = 1;
  while (student_tails(hi, freedom) > p && hi < kFarOut) hi *= 2;
  for (int i = 0; i < 100; ++i) {
    const double mid = (lo + hi) / 2;
    (student_tails(mid, freedom) > p ? lo : hi) = mid;
  }
  return lo;
}

double chi2_tail(double x, double freedom) {
  if (std::isnan(x)) return 0;
  return gamma_tail(freedom / 2, x / 2);
}

}  // namespace ls::cli
