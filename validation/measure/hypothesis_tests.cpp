#include "validation/measure/hypothesis_tests.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/complement.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace ls::cli {
namespace {

namespace math = boost::math;

// NaN figures and zero degrees of freedom are errors of the measurement: they get the probability 0 instead
// of an exception, and the caller reports them.
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

}  // namespace ls::cli
