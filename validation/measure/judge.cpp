#include "validation/measure/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "validation/measure/hypothesis_tests.h"

namespace ls::cli {

namespace {

// Sets z. Its unit includes the allowance: in units of the standard error alone, a figure with almost no
// variance that is off by one ulp would have a z in the hundreds.
void measure_z(ValidateCase& c, double allowance) {
  const double unit = std::hypot(c.standard_error, allowance);
  c.allowance = allowance;
  c.z = unit > 0 ? (c.got - c.expected) / unit : 0;
}

}  // namespace

void judge(ValidateCase& c, double freedom, double rounding) {
  const double off = c.got - c.expected, beyond = std::max(0., std::abs(off) - rounding);
  measure_z(c, rounding);
  c.p = c.standard_error > 0 ? student_tails(beyond / c.standard_error, freedom) : beyond > 0 ? 0. : 1.;
  if (c.nonfinite > 0)
    c.why = fmt::format("{} samples were not finite", c.nonfinite);
  else if (!std::isfinite(c.got) || !std::isfinite(c.standard_error))
    c.why = "the figure or its error is not finite";
  else if (!(c.p > c.level))
    c.why = fmt::format("p = {:.2g} is below {:.2g}", c.p, c.level);
}

void judge_equivalence(ValidateCase& c, double freedom, double unknown, double rounding, double least) {
  const double off = std::abs(c.got - c.expected), room = c.band * std::abs(c.expected);
  const bool known = c.standard_error <= rounding;
  const double f = known ? std::max(freedom, least) : freedom;
  const double half = student_quantile(c.level, f) * c.standard_error + unknown;
  const double reach = off + student_quantile(c.band_level, f) * c.standard_error + unknown;
  measure_z(c, unknown);
  c.p = c.standard_error > 0 ? student_tails(std::max(0., off - unknown) / c.standard_error, f)
        : off > unknown      ? 0.
                             : 1.;
  if (c.nonfinite > 0) {
    c.why = fmt::format("{} samples went wrong", c.nonfinite);
  } else if (!std::isfinite(c.got) || !std::isfinite(c.standard_error)) {
    c.why = "the figure or its error is not finite";
  } else if (off > half) {
    c.why = fmt::format("the interval +- {:.3g} misses the answer by {:.3g}", half, off);
  } else if (!known && freedom < least) {
    c.too_wide = true;
    c.why = fmt::format("a few pixels rule the error: {:.3g} degrees of freedom", freedom);
  } else if (!(reach <= room)) {
    c.too_wide = true;
    c.why = fmt::format("the interval reaches {:.3g} from the answer, the band {:.3g}", reach, room);
  }
}

}  // namespace ls::cli
