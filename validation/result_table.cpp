#include "validation/result_table.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace ls::cli {
namespace {

using nlohmann::ordered_json;

// JSON has no infinity.
ordered_json number(double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(); }

// Cases of a Nori file have no band (the deviation that the table's own cases tolerate).
std::string band_of(const ValidateCase& c) {
  return c.kind.empty() ? "-" : c.kind == "exact" ? "exact" : fmt::format("{:.3g} %", 100 * c.band);
}

}  // namespace

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
