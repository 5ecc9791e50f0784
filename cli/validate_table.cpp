#include "cli/validate_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/validate_stats.h"

namespace ls::cli {
namespace {

using nlohmann::ordered_json;

// JSON has no infinity.
ordered_json number(double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(); }

}  // namespace

void judge(ValidateCase& c, double freedom, double rounding) {
  const double off = c.got - c.expected, beyond = std::max(0., std::abs(off) - rounding);
  c.z = c.standard_error > 0 ? off / c.standard_error : 0;
  c.p = c.standard_error > 0 ? student_tails(beyond / c.standard_error, freedom) : beyond > 0 ? 0. : 1.;
  if (c.nonfinite > 0)
    c.why = fmt::format("{} samples were not finite", c.nonfinite);
  else if (!std::isfinite(c.got) || !std::isfinite(c.standard_error))
    c.why = "the figure or its error is not finite";
  else if (!(c.p > c.level))
    c.why = fmt::format("p = {:.2g} is below {:.2g}", c.p, c.level);
}

std::string table_heading() {
  return fmt::format("{:<40} {:>14} {:>14} {:>10} {:>7} {:>7} {:>8}", "case", "expected", "got", "stderr",
                     "z", "verdict", "seconds");
}

std::string table_line(const ValidateCase& c) {
  return fmt::format("{:<40} {:>14.8g} {:>14.8g} {:>10.2e} {:>7.2f} {:>7} {:>8.2f}{}", c.name, c.expected,
                     c.got, c.standard_error, c.z, c.passed() ? "pass" : "FAIL", c.seconds,
                     c.passed() ? "" : "  " + c.why);
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
                    {"z", number(c.z)},
                    {"p", number(c.p)},
                    {"level", c.level},
                    {"verdict", c.passed() ? "pass" : "fail"},
                    {"nonfinite", c.nonfinite},
                    {"seconds", c.seconds}});
    if (!c.passed()) list.back()["why"] = c.why;
  }
  return {{"cases", std::move(list)}, {"passed", cases.size() - failed}, {"failed", failed}};
}

}  // namespace ls::cli
