// A logarithmic axis: range, ticks and labels. The dashboard's (web/static/js/plot_scale.js) follows the same
// rules.
#pragma once

#include <string>
#include <vector>

namespace ls::report {

struct LogAxis {
  double lo = 1, hi = 10;         // values at its ends, both above 0
  double from = 0, to = 1;        // their positions in the drawing
  double at(double value) const;  // position of a value above 0
};
// An axis for values from `lo` to `hi` (above 0, lo <= hi), with a margin, at least one decade wide.
LogAxis log_axis(double lo, double hi, double from, double to);

struct Tick {
  double value = 0;
  std::string label;  // empty: a line without a label
  bool major = false;
};
enum class AxisUnit {
  plain,    // 0.1, 0.01, 10⁻⁴
  seconds,  // 1 s, 10 s, 1 min, 1 h, 1 d
};
// In ascending order. Decades are labelled (for time its usual steps), values between them if decades are
// few; on a long axis only every n-th decade.
std::vector<Tick> ticks(const LogAxis& axis, AxisUnit unit);

}  // namespace ls::report
