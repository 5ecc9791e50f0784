// Curves over two logarithmic axes, as SVG: bands, a target line, a forecast, a legend. Pure: the same plot
// gives the same text.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/report/log_axis.h"

namespace ls::report {

struct CurvePoint {
  double x = 0, y = 0;    // points whose x or y is not finite and above 0 are omitted
  double lo = 0, hi = 0;  // interval of y; zeros: none
};
struct Curve {
  std::string name;  // for the legend, shown with two curves or more
  std::vector<CurvePoint> points;
  bool dashed = false;
};
inline constexpr std::size_t kMostCurves = 8;         // with distinct colours and marks
inline constexpr std::size_t kMostCurvePoints = 512;  // drawn per curve; longer curves are thinned evenly

// A predicted point: the x at which the first curve will reach the target.
struct Ahead {
  double x = 0, x_lo = 0, x_hi = 0;  // interval in x; x_lo = x_hi = 0: none
  double x_with_more = 0;            // the x at which it is reached with more workers; 0: unknown
};

struct LogPlot {
  std::string id;       // letters, digits and -: unique in its page
  std::string title;    // for screen readers, and as the drawing's name
  std::string summary;  // description in one sentence
  std::string x_title, y_title;
  AxisUnit x_unit = AxisUnit::seconds;
  std::vector<Curve> curves;
  std::optional<double> target;  // horizontal line at this y
  std::optional<Ahead> ahead;    // only with a target
};

// Returns an SVG element for use inside a page whose style has plot_css(). For a plot without points it says
// so.
std::string svg_of(const LogPlot& plot);
// Returns the content of a separate SVG file, which follows the reader's dark or light mode.
std::string standalone_svg(const LogPlot& plot);
std::string_view plot_css();

}  // namespace ls::report
