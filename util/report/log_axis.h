// A logarithmic axis: range, ticks and labels. The axes of the dashboard (web/static/js/plot_scale.js) follow
// the same rules.
#pragma once

#include <string>
#include <vector>

namespace ls::report {

struct LogAxis {
  double lo = 1, hi = 10;         // values at the ends of the axis, both above 0
  double from = 0, to = 1;        // positions of the ends in the drawing
  double at(double value) const;  // returns the position of a value above 0
};
// Returns an axis for values from `lo` to `hi` (0 < lo <= hi). A margin is added, and the axis is at least
// one decade wide. `from` and `to` are the positions of its ends in the drawing.
LogAxis log_axis(double lo, double hi, double from, double to);

struct Tick {
  double value = 0;
  std::string label;  // text at the tick; empty: a line without a label
  bool major = false;
};
enum class AxisUnit {
  plain,    // labels such as 0.1, 0.01, 10⁻⁴
  seconds,  // labels such as 1 s, 10 s, 1 min, 1 h, 1 d
};
// Returns the ticks in ascending order. Labels are at powers of ten, or for times at usual values (1 s, 10 s,
// 1 min, ...). A short axis also has labels between these. A long axis has a label only at every second,
// third, ... of these values, so that there are not too many labels.
std::vector<Tick> ticks(const LogAxis& axis, AxisUnit unit);

}  // namespace ls::report
