// The renderer against answers that are known without it. For each channel of each case the confidence
// interval must cover the answer and lie inside the case's band around it (equivalence, not mere failure to
// reject). A right renderer fails anywhere in the whole table with probability kFalsePositives, split evenly
// over all checks by Sidak; seeds are fixed, so it either always or never does.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/statistical/case.h"
#include "tests/support/render_check.h"

namespace ls::test {
namespace {

constexpr double kFalsePositives = 1e-3;
// Radiance is float32: a path of n vertices multiplies about 10 n numbers, each rounded by 2^-24, and
// rounding errors of many samples partly share their sign. 2^-16 holds for paths of 25 vertices in the worst
// case.
constexpr double kRounding = 0x1p-16;
// Fewer than this and the standard error itself is not known well enough for the quantile below. Not asked
// where the error is below what is allowed for float32: there the few pixels whose sums round differently are
// all that varies.
constexpr double kLeastFreedom = 40;

const std::vector<Case>& table() {
  static const std::vector<Case> cases = [] {
    std::vector<Case> c;
    add_attenuation(c);
    add_furnaces(c);
    add_single_scattering(c);
    add_slabs(c);
    add_surfaces(c);
    add_extremes(c);
    add_environments(c);
    add_materials(c);
    add_distant(c);
    add_emission(c);
    add_overlaps(c);
    add_points_in_grids(c);
    return c;
  }();
  return cases;
}

// x with P(|Z| > x) = p for a standard normal Z.
double two_sided_quantile(double p) {
  double lo = 0, hi = 20;
  for (int i = 0; i < 100; ++i) {
    const double mid = (lo + hi) / 2;
    (std::erfc(mid / std::sqrt(2.)) > p ? lo : hi) = mid;
  }
  return lo;
}
// Student's t by Cornish and Fisher (Abramowitz and Stegun 26.7.5): for 40 degrees of freedom and z = 4.5
// good to .5 %.
double student(double z, double freedom) {
  const double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96 * freedom * freedom) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * freedom * freedom * freedom);
}

void heading() {
  static bool printed = false;
  if (printed) return;
  printed = true;
  fmt::print("{:<44} c {:>15} {:>15} {:>10} {:>7} {:>9}\n", "case", "expected", "got", "se", "z", "interval");
}

class ClosedForm : public testing::TestWithParam<std::size_t> {};

TEST_P(ClosedForm, IsMatchedInEveryChannel) {
  const Case& c = table()[GetParam()];
  const double checks = 3. * static_cast<double>(table().size());
  const double z = two_sided_quantile(-std::expm1(std::log1p(-kFalsePositives) / checks));

  const Estimate e = estimate(c.kit, c.spp, 1 + GetParam());

  heading();
  EXPECT_EQ(e.health.nonfinite, 0u);
  EXPECT_EQ(e.health.negative, 0u);
  EXPECT_EQ(e.health.majorant_violations, 0u);
  for (std::size_t k = 0; k < 3; ++k) {
    const double got = c.complement ? 1 - e.mean[k] : e.mean[k], off = std::abs(got - c.expected[k]);
    const double rounding = kRounding * std::abs(c.expected[k]);
    const double freedom = e.standard_error[k] < rounding ? kLeastFreedom : e.freedom[k];
    const double half =
        student(z, freedom) * e.standard_error[k] + rounding + c.slack * std::abs(c.expected[k]);
    fmt::print("{:<44} {} {:>15.9g} {:>15.9g} {:>10.2e} {:>7.2f} {:>8.3f}%\n", c.name, "RGB"[k],
               c.expected[k], got, e.standard_error[k],
               e.standard_error[k] > 0 ? (got - c.expected[k]) / e.standard_error[k] : 0.,
               c.expected[k] != 0 ? 100 * (off + half) / std::abs(c.expected[k]) : 0.);
    EXPECT_GE(freedom, kLeastFreedom) << "a few pixels rule the error of channel " << k;
    EXPECT_LE(off, half) << "the interval misses the answer in channel " << k;
    EXPECT_LE(off + half, c.band * std::abs(c.expected[k])) << "the interval is too wide in channel " << k;
  }
  std::fflush(stdout);
}

INSTANTIATE_TEST_SUITE_P(All, ClosedForm, testing::Range(std::size_t{0}, table().size()),
                         [](const auto& info) { return table()[info.param].name; });

}  // namespace
}  // namespace ls::test
