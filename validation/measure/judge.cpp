#include "validation/measure/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "validation/measure/hypothesis_tests.h"

namespace ls::cli {
namespace {

using nlohmann::ordered_json;

// Sets z and the allowance. The unit of z includes the allowance: in units of the standard error alone, a
// figure with almost no variance that is off by one ulp would have a z in the hundreds.
void measure_z(ValidateCase& c, double allowance) {
  const double unit = std::hypot(c.standard_error, allowance);
  c.allowance = allowance;
  c.z = unit > 0 ? (c.got - c.expected) / unit : 0;
}

// Returns the number, or null if it is infinite or NaN, which JSON cannot express.
ordered_json number(double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(); }

// Returns the column "band" of a line. The band is the deviation that a case tolerates. Cases of a Nori file
// have none.
std::string band_of(const ValidateCase& c) {
  return c.kind.empty() ? "-" : c.kind == "exact" ? "exact" : fmt::format("{:.3g} %", 100 * c.band);
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

std::string table_heading() {
  return fmt::format("{:<60} {:>14} {:>14} {:>10} {:>7} {:>7} {:>7} {:>9} {:>8}", "case", "expected", "got",
                     "stderr", "z", "band", "verdict", "nonfinite", "seconds");
}

std::string table_line(const ValidateCase& c) {
  return fmt::format("{:<60} {:>14.8g} {:>14.8g} {:>10.2e} {:>7.2f} {:>7} {:>7} {:>9} {:>8.2f}{}", c.name,
                     c.expected, c.got, c.standard_error, c.z, band_of(c), c.passed() ? "pass" : "FAIL",
                     c.nonfinite, c.seconds, c.passed() ? "" : "  " + c.why);
}

ordered_json table_json(const std::vector<ValidateCase>& cases) {
  ordered_json list = ordered_json::array();
  std::size_t failed = 0;
  for (const ValidateCase& c : cases) {
    failed += c.passed() ? 0 : 1;
    list.push_back({{"name", c.name},
                    {"expected", number(c.expected)},
                    {"got", number(c.got)},
                    {"stderr", number(c.standard_error)},
                    {"allowance", number(c.allowance)},
                    {"z", number(c.z)},
                    {"p", number(c.p)},
                    {"level", c.level},
                    {"verdict", c.passed() ? "pass" : "fail"},
                    {"nonfinite", c.nonfinite},
                    {"seconds", c.seconds}});
    ordered_json& line = list.back();
    if (!c.kind.empty()) {
      line["rows"] = c.rows;
      line["about"] = c.about;
      line["kind"] = c.kind;
      line[c.kind == "exact" ? "tolerance" : "band"] = c.band;
      if (!c.why_band.empty()) line["why_band"] = c.why_band;
      line["paths"] = c.paths;
    }
    if (!c.passed()) line["why"] = c.why;
  }
  return {{"cases", std::move(list)}, {"passed", cases.size() - failed}, {"failed", failed}};
}

}  // namespace ls::cli
