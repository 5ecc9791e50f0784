// A logarithmic axis: its range, its ticks and how they are labelled. The dashboard's
// (web/static/js/plot_scale.js) follows the same rules.
#pragma once

#include <string>
#include <vector>

namespace ls::report {

struct LogAxis {
  double lo = 1, hi = 10;         // values at its ends, both above 0
  double from = 0, to = 1;        // where they are drawn
  double at(double value) const;  // where a value above 0 is drawn
};
// Around values from `lo` to `hi` (above 0, lo <= hi), with a margin, at least one decade wide.
LogAxis log_axis(double lo, double hi, double from, double to);

struct Tick {
  double value = 0;
  std::string label;  // empty: a line alone
  bool major = false;
};
enum class AxisUnit {
  plain,    // 0.1, 0.01, 10⁻⁴
  seconds,  // 1 s, 10 s, 1 min, 1 h, 1 d
};
// Ascending. Decades are labelled (of time its usual steps), what lies between them where there are few; of a
// long axis only every so many.
std::vector<Tick> ticks(const LogAxis& axis, AxisUnit unit);

}  // namespace ls::report
