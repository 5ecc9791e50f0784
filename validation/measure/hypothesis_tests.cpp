#include "validation/measure/hypothesis_tests.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/complement.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <vector>

namespace ls::cli {
namespace {

namespace math = boost::math;

// NaN figures and zero degrees of freedom are errors of the measurement. Under this policy they give the
// probability 0 instead of an exception, and the caller reports them.
using Quiet = math::policies::policy<math::policies::domain_error<math::policies::ignore_error>,
                                     math::policies::overflow_error<math::policies::ignore_error>,
                                     math::policies::evaluation_error<math::policies::ignore_error>,
                                     math::policies::promote_double<false>>;
using Student = math::students_t_distribution<double, Quiet>;
using ChiSquared = math::chi_squared_distribution<double, Quiet>;

double or_nothing(double p) { return std::isnan(p) ? 0 : p; }

}  // namespace

double sidak(double level, std::size_t n) {
  return -std::expm1(std::log1p(-level) / static_cast<double>(std::max<std::size_t>(n, 1)));
}

double student_tails(double t, double freedom) {
  return or_nothing(2 * math::cdf(math::complement(Student(freedom), std::abs(t))));
}

double student_quantile(double p, double freedom) {
  return or_nothing(math::quantile(math::complement(Student(freedom), p / 2)));
}

double chi2_tail(double x, double freedom) {
  return or_nothing(math::cdf(math::complement(ChiSquared(freedom), std::max(x, 0.))));
}

ChiSquare chi_square(std::span<const double> expected, std::span<const double> observed, double least) {
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return expected[a] < expected[b]; });
  std::vector<std::array<double, 2>> cells;  // expected and observed samples of each merged cell
  double e = 0, o = 0;
  for (const std::size_t i : order) {
    e += std::max(0., expected[i]);
    o += observed[i];
    if (e < least) continue;
    cells.push_back({e, o});
    e = o = 0;
  }
  if (cells.empty() && e > 0) cells.push_back({0, 0});
  ChiSquare r;
  if (cells.empty())
    r.impossible = o;
  else  // the remaining ones are too few for a cell of their own
    cells.back()[0] += e, cells.back()[1] += o;
  for (const auto& [want, got] : cells) r.statistic += (got - want) * (got - want) / want;
  for (std::size_t i = 0; i < expected.size(); ++i)
    if (expected[i] <= 0 && observed[i] > least) r.impossible = observed[i];
  r.freedom = std::max(1, static_cast<int>(cells.size()) - 1);
  r.p = chi2_tail(r.statistic, r.freedom);
  return r;
}

}  // namespace ls::cli
