// Curves over two logarithmic axes, as SVG: bands, a target line, a forecast, a legend. The output depends
// only on the plot.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ls::report {

struct CurvePoint {
  double x = 0, y = 0;    // points are drawn only if x and y are finite and above 0
  double lo = 0, hi = 0;  // interval (lo, hi) of y; both 0: there is none
};
struct Curve {
  std::string name;  // for the legend, which is shown if there are several curves
  std::vector<CurvePoint> points;
  bool dashed = false;
};
inline constexpr std::size_t kMostCurves = 8;  // Each curve has its own colour; further curves are not drawn.
// Largest number of points drawn per curve. If a curve has more points, evenly chosen ones are drawn.
inline constexpr std::size_t kMostCurvePoints = 512;

// A forecast: the x at which the first curve will reach the target.
struct Ahead {
  double x = 0, x_lo = 0, x_hi = 0;  // x, and its interval; x_lo = x_hi = 0: no interval
};

struct LogPlot {
  std::string id;                // letters, digits and -; must be unique in its page
  std::string title;             // title for screen readers
  std::string summary;           // description in one sentence
  std::string x_title, y_title;  // titles of the axes; x is in seconds
  std::vector<Curve> curves;
  std::optional<double> target;  // horizontal line at this y
  std::optional<Ahead> ahead;    // forecast; drawn only if there is a target
};

// Returns an SVG element for a page whose style includes plot_css(). If there are no points, the drawing has
// a note instead.
std::string svg_of(const LogPlot& plot);
// Returns the content of a separate SVG file, which follows the viewer's dark or light mode.
std::string standalone_svg(const LogPlot& plot);
std::string_view plot_css();

}  // namespace ls::report
