// A logarithmic axis: range, ticks and labels. The axes of the dashboard (web/static/js/plot_scale.js) follow
// the same rules.
#pragma once

#include <string>
#include <vector>

namespace ls::report {

struct LogAxis {
  double lo = 1, hi = 10;         // values at its ends, both above 0
  double from = 0, to = 1;        // their positions in the drawing
  double at(double value) const;  // position of a value above 0
};
// Returns an axis for values from `lo` to `hi` (above 0, lo <= hi), with a margin, at least one decade wide.
// `from` and `to` are the positions of its ends in the drawing.
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
// Returns the ticks in ascending order. Decades are labelled, or for time its usual steps (1 s, 10 s, 1 min,
// ...). On a short axis some values between decades are labelled too, on a long one only every n-th decade.
std::vector<Tick> ticks(const LogAxis& axis, AxisUnit unit);

}  // namespace ls::report
