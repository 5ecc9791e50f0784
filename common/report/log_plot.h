// Curves over two logarithmic axes, as SVG: bands, a target line, a forecast, a legend. Pure: the same plot
// is the same text.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/report/log_axis.h"

namespace ls::report {

struct CurvePoint {
  double x = 0, y = 0;    // what is not above 0 (or not finite) cannot stand on such axes and is left out
  double lo = 0, hi = 0;  // an interval of y; zeros: there is none
};
struct Curve {
  std::string name;  // for the legend, which there is with two curves or more
  std::vector<CurvePoint> points;
  bool dashed = false;
};
inline constexpr std::size_t kMostCurves = 8;         // that have colours and marks of their own
inline constexpr std::size_t kMostCurvePoints = 512;  // drawn of each; of more, evenly chosen ones

// Where the first curve is expected to come down to the target.
struct Ahead {
  double x = 0, x_lo = 0, x_hi = 0;  // with an interval; x_lo = x_hi = 0: none
  double x_with_more = 0;            // with more workers; 0: not known
};

struct LogPlot {
  std::string id;       // letters, digits and -: unique in its page
  std::string title;    // for readers of the screen, and as the drawing's name
  std::string summary;  // what it shows, in a sentence
  std::string x_title, y_title;
  AxisUnit x_unit = AxisUnit::seconds;
  std::vector<Curve> curves;
  std::optional<double> target;  // a line across, of y
  std::optional<Ahead> ahead;    // only with a target
};

// For the inside of a page whose style has plot_css(). A plot without a point says so.
std::string svg_of(const LogPlot& plot);
// A file of its own, dark or light as the reader has it.
std::string standalone_svg(const LogPlot& plot);
std::string_view plot_css();

}  // namespace ls::report
