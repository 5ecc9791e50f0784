#include "tests/property/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::test {
namespace {

// Below, a few pixels rule and a standard error means nothing: such a pair is left undecided.
constexpr double kLeastFreedom = 25;
// Rounding error of float32 along paths of a dozen vertices: see validation/measure/judge.h.
constexpr double kRounding = 0x1p-16;

}  // namespace

Comparison compare(const Estimate& a, const Estimate& b, double level) {
  Comparison all;
  for (std::size_t c = 0; c < 3; ++c) {
    const double se = std::hypot(a.standard_error[c], b.standard_error[c]);
    const double rounding = kRounding * (std::abs(a.mean[c]) + std::abs(b.mean[c]));
    const double off = std::abs(a.mean[c] - b.mean[c]), freedom = std::min(a.freedom[c], b.freedom[c]);
    if (off <= rounding) continue;
    // Whatever the tails are, what is within two standard errors is no news.
    if (freedom < kLeastFreedom && off > 2 * se) {
      all.verdict = std::max(all.verdict, Verdict::undecided);
    } else if (off > cli::student_quantile(level, freedom) * se + rounding) {
      all.verdict = Verdict::different;
      all.told += fmt::format("channel {}: {} +- {} and {} +- {}, freedom {:.0f}\n", c, a.mean[c],
                              a.standard_error[c], b.mean[c], b.standard_error[c], freedom);
    }
  }
  return all;
}

Comparison look(const SceneBuilder& a, const SceneBuilder& b, std::uint64_t seed, double level, Looks looks) {
  const auto at = [&](std::uint64_t spp, std::uint64_t s, double alpha) {
    return compare(estimate(a, spp, s), estimate(b, spp, s + 1), alpha);
  };
  const Comparison first = at(looks.first, seed, .01);
  return first.verdict == Verdict::alike ? first : at(looks.second, seed + 5, level);
}

}  // namespace ls::test
