#include "util/report/log_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "util/report/html.h"
#include "util/report/log_axis.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

namespace ls::report {
namespace {

constexpr double kWidth = 520, kLeft = 60, kRight = 504, kTop = 14;
constexpr double kPlotHeight = 290, kBelow = 50, kLegendLine = 22;
// Half the width of the widest time label, in units of the drawing. The middle of a label keeps this distance
// from the right edge of the drawing, so that the label is not cut off.
constexpr double kHalfLabel = 25;
constexpr double kLetter = 7.4;  // mean width of a letter in the legend, in units of the drawing
// A forecast is drawn only if its x is less than kFarthestAhead times the x of the last point.
constexpr double kFarthestAhead = 100;

using Out = std::back_insert_iterator<std::string>;

bool drawable(const CurvePoint& p) { return std::isfinite(p.x) && std::isfinite(p.y) && p.x > 0 && p.y > 0; }
bool has_band(const CurvePoint& p) { return std::isfinite(p.hi) && p.lo > 0 && p.hi >= p.lo; }

// Returns the points of a curve to draw, in order of x: at most kMostCurvePoints, evenly chosen from all.
std::vector<CurvePoint> chosen(const Curve& curve) {
  std::vector<CurvePoint> all;
  std::copy_if(curve.points.begin(), curve.points.end(), std::back_inserter(all), drawable);
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  if (all.size() <= kMostCurvePoints) return all;
  std::vector<CurvePoint> some;
  for (std::size_t i = 0; i < kMostCurvePoints; ++i)
    some.push_back(all[i * (all.size() - 1) / (kMostCurvePoints - 1)]);
  return some;
}

class Drawing {
 public:
  explicit Drawing(const LogPlot& plot) : plot_(plot), id_(plot.id) {
    std::replace_if(
        id_.begin(), id_.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '-');
    for (const Curve& curve : plot.curves)
      if (curves_.size() < kMostCurves) curves_.push_back({&curve, chosen(curve)});
    drawn_ = std::any_of(curves_.begin(), curves_.end(), [](const auto& c) { return !c.points.empty(); });
    if (!drawn_) return;
    if (curves_.size() > 1) place_legend();
    set_axes();
  }

  std::string svg(std::string_view style) {
    const double height = kTop + legend_height_ + kPlotHeight + kBelow;
    fmt::format_to(
        out(),
        R"(<svg class="plot" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {:g} {:g}" role="img" aria-labelledby="{}-t {}-d">)",
        kWidth, height, id_, id_);
    fmt::format_to(out(), R"(<title id="{}-t">{}</title><desc id="{}-d">{}</desc>)", id_,
                   escape_html(plot_.title), id_, escape_html(plot_.summary));
    if (!style.empty())
      fmt::format_to(out(), R"(<style>{}</style><rect class="ground" width="{:g}" height="{:g}"/>)", style,
                     kWidth, height);
    if (drawn_)
      draw();
    else
      fmt::format_to(out(), R"(<text class="tick" x="{:g}" y="{:g}" text-anchor="middle">{}</text>)",
                     kWidth / 2, height / 2, phrase("noPointYet"));
    return text_ + "</svg>";
  }

 private:
  struct Line {
    const Curve* curve;
    std::vector<CurvePoint> points;
  };
  Out out() { return std::back_inserter(text_); }

  bool shows_ahead() const {
    return plot_.ahead && plot_.target && *plot_.target > 0 && !curves_[0].points.empty() &&
           plot_.ahead->x > curves_[0].points.back().x &&
           plot_.ahead->x < kFarthestAhead * curves_[0].points.back().x;
  }

  void set_axes() {
    std::vector<double> xs, ys;
    for (const Line& line : curves_)
      for (const CurvePoint& p : line.points) {
        xs.push_back(p.x);
        ys.push_back(p.y);
        if (has_band(p)) ys.insert(ys.end(), {p.lo, p.hi});
      }
    if (plot_.target && *plot_.target > 0) ys.push_back(*plot_.target);
    if (shows_ahead()) {
      const double most = kFarthestAhead * curves_[0].points.back().x;
      for (const double x : {plot_.ahead->x, plot_.ahead->x_hi})
        if (x > 0) xs.push_back(std::min(x, most));
    }
    const auto [x0, x1] = std::minmax_element(xs.begin(), xs.end());
    const auto [y0, y1] = std::minmax_element(ys.begin(), ys.end());
    const double top = kTop + legend_height_;
    x_ = log_axis(*x0, *x1, kLeft, kRight);
    y_ = log_axis(*y0, *y1, top + kPlotHeight, top);
  }

  void place_legend() {
    double x = kLeft;
    legend_height_ = kLegendLine;
    for (const Line& line : curves_) {
      const double width =
          34 + kLetter * static_cast<double>(std::min<std::size_t>(line.curve->name.size(), 56));
      if (x > kLeft && x + width > kRight) x = kLeft, legend_height_ += kLegendLine;
      legend_.push_back({x, kTop + legend_height_ - kLegendLine + 8});
      x += width + 10;
    }
    legend_height_ += 6;
  }

  void draw() {
    draw_grid();
    fmt::format_to(out(),
                   R"(<clipPath id="{}-c"><rect x="{:g}" y="{:.1f}" width="{:g}" height="{:g}"/></clipPath>)",
                   id_, kLeft, y_.to - 6, kRight - kLeft, kPlotHeight + 12);
    fmt::format_to(out(), R"svg(<g clip-path="url(#{}-c)">)svg", id_);
    for (std::size_t i = 0; i < curves_.size(); ++i) draw_band(i);
    if (plot_.target && *plot_.target > 0) draw_target(*plot_.target);
    if (shows_ahead()) draw_ahead(*plot_.ahead, *plot_.target);
    for (std::size_t i = 0; i < curves_.size(); ++i) draw_curve(i);
    text_ += "</g>";
    draw_legend();
  }

  void draw_grid() {
    const double bottom = y_.from, top = y_.to;
    text_ += R"(<g class="grid">)";
    for (const Tick& t : ticks(x_, AxisUnit::seconds)) {
      const double x = x_.at(t.value);
      fmt::format_to(out(), R"(<path{} d="M{:.1f} {:.1f}V{:.1f}"/>)", t.major ? R"( class="major")" : "", x,
                     top, bottom);
      if (!t.label.empty())
        fmt::format_to(out(), R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)",
                       std::min(x, kWidth - kHalfLabel), bottom + 19, t.label);
    }
    for (const Tick& t : ticks(y_, AxisUnit::plain)) {
      const double y = y_.at(t.value);
      fmt::format_to(out(), R"(<path{} d="M{:g} {:.1f}H{:g}"/>)", t.major ? R"( class="major")" : "", kLeft,
                     y, kRight);
      if (!t.label.empty())
        fmt::format_to(out(), R"(<text class="tick" x="{:g}" y="{:.1f}" text-anchor="end">{}</text>)",
                       kLeft - 8, y + 4.5, t.label);
    }
    text_ += "</g>";
    fmt::format_to(out(), R"(<text class="axis" x="{:g}" y="{:.1f}" text-anchor="end">{}</text>)", kRight,
                   bottom + 42, escape_html(plot_.x_title));
    fmt::format_to(
        out(),
        R"svg(<text class="axis" transform="translate(14 {:.1f}) rotate(-90)" text-anchor="end">{}</text>)svg",
        top, escape_html(plot_.y_title));
  }

  void draw_band(std::size_t index) {
    std::string up, down;
    int banded = 0;
    for (const CurvePoint& p : curves_[index].points) {
      if (!has_band(p)) continue;
      ++banded;
      up += fmt::format(" {:.1f},{:.1f}", x_.at(p.x), y_.at(p.hi));
      down = fmt::format(" {:.1f},{:.1f}", x_.at(p.x), y_.at(p.lo)) + down;
    }
    if (banded > 1)
      fmt::format_to(out(), R"(<polygon class="band c{}" points="{}{}"/>)", index, up.substr(1), down);
  }

  void draw_target(double target) {
    const double y = y_.at(target);
    fmt::format_to(
        out(),
        R"(<path class="target" d="M{:g} {:.1f}H{:g}"/><text class="target-text" x="{:g}" y="{:.1f}">target {}</text>)",
        kLeft, y, kRight, kLeft + 6, y - 6, given(target));
  }

  void draw_ahead(const Ahead& ahead, double target) {
    const CurvePoint& last = curves_[0].points.back();
    const double x0 = x_.at(last.x), y0 = y_.at(last.y), y = y_.at(target), x = x_.at(ahead.x);
    if (ahead.x_lo > 0 && ahead.x_hi > ahead.x_lo) {
      const double lo = x_.at(std::max(ahead.x_lo, last.x)), hi = x_.at(std::min(ahead.x_hi, x_.hi));
      fmt::format_to(out(), R"(<polygon class="fan c0" points="{:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f}"/>)",
                     x0, y0, lo, y, hi, y);
      fmt::format_to(out(),
                     R"(<path class="span c0" d="M{:.1f} {:.1f}v10M{:.1f} {:.1f}H{:.1f}M{:.1f} {:.1f}v10"/>)",
                     lo, y - 5, lo, y, hi, hi, y - 5);
    }
    fmt::format_to(out(), R"(<path class="ahead c0" d="M{:.1f} {:.1f}L{:.1f} {:.1f}"/>)", x0, y0, x, y);
    fmt::format_to(out(), R"(<path class="dot c0" d="M{:.1f} {:.1f}l5 5l-5 5l-5 -5z"/>)", x, y - 5);
  }

  std::string said(const CurvePoint& p) const {
    const std::string ci = has_band(p) ? fmt::format(" ({} to {})", figure(p.lo), figure(p.hi)) : "";
    return fmt::format("{}{} at {}", figure(p.y), ci, duration(p.x));
  }

  void draw_curve(std::size_t index) {
    const Line& line = curves_[index];
    if (line.points.size() > 1) {
      std::string path;
      for (const CurvePoint& p : line.points) path += fmt::format(" {:.1f},{:.1f}", x_.at(p.x), y_.at(p.y));
      fmt::format_to(out(), R"(<polyline class="line c{}{}" points="{}"/>)", index,
                     line.curve->dashed ? " dashed" : "", path.substr(1));
    }
    fmt::format_to(out(), R"(<g class="dots c{}">)", index);
    for (const CurvePoint& p : line.points)
      fmt::format_to(out(), R"(<path d="{}"><title>{}</title></path>)", mark(index, x_.at(p.x), y_.at(p.y)),
                     said(p));
    text_ += "</g>";
  }

  // Draws a mark at (x, y) for a point of curve number `index`. There are four shapes, by the curve's index,
  // so that up to four curves can be distinguished without colour.
  static std::string mark(std::size_t index, double x, double y) {
    switch (index % 4) {
      case 1:
        return fmt::format("M{:.1f} {:.1f}h5.6v5.6h-5.6z", x - 2.8, y - 2.8);
      case 2:
        return fmt::format("M{:.1f} {:.1f}l3.6 6.2h-7.2z", x, y - 3.8);
      case 3:
        return fmt::format("M{:.1f} {:.1f}l3.6 3.6l-3.6 3.6l-3.6 -3.6z", x, y - 3.6);
      default:
        return fmt::format("M{:.1f} {:.1f}a3 3 0 1 1 6 0a3 3 0 1 1 -6 0z", x - 3, y);
    }
  }

  void draw_legend() {
    for (std::size_t i = 0; i < legend_.size(); ++i) {
      const auto [x, y] = legend_[i];
      fmt::format_to(
          out(), R"(<path class="line c{}{}" d="M{:.1f} {:.1f}h22"/><g class="dots c{}"><path d="{}"/></g>)",
          i, curves_[i].curve->dashed ? " dashed" : "", x, y, i, mark(i, x + 11, y));
      fmt::format_to(out(), R"(<text class="name" x="{:.1f}" y="{:.1f}">{}</text>)", x + 29, y + 4.5,
                     escape_html(std::string_view(curves_[i].curve->name).substr(0, 56)));
    }
  }

  const LogPlot& plot_;
  std::string id_;
  std::vector<Line> curves_;
  std::vector<std::pair<double, double>> legend_;
  double legend_height_ = 0;
  bool drawn_ = false;
  LogAxis x_, y_;
  std::string text_;
};

}  // namespace

std::string_view plot_css() {
  return R"(
.plot{--ink:#2b2a27;--soft:#6a675f;--line:#ece8df;--mid:#d5cfc2;--aim:#2c7a4b;--paper:#fffdf9;
--k0:#b3651a;--k1:#2a6fb0;--k2:#2c7a4b;--k3:#8e4fa8;--k4:#b03a4a;--k5:#4c6670;--k6:#8a7a12;--k7:#5a57c2;display:block;width:100%;height:auto}
@media (prefers-color-scheme:dark){.plot{--ink:#ece9e2;--soft:#a3a8b3;--line:#22262f;--mid:#363d4a;--aim:#93d2a6;--paper:#0f1116;
--k0:#f4c27a;--k1:#7cc4ff;--k2:#8fdca0;--k3:#c9a7ff;--k4:#ff9d8a;--k5:#a9b8c8;--k6:#d6e36b;--k7:#a9b8ff}}
.plot text{font:13.5px/1 Inter,"Segoe UI","Helvetica Neue",Cantarell,"Noto Sans",system-ui,"DejaVu Sans",sans-serif;font-variant-numeric:tabular-nums}
.plot .ground{fill:var(--paper)}
.plot .c0{--k:var(--k0)}.plot .c1{--k:var(--k1)}.plot .c2{--k:var(--k2)}.plot .c3{--k:var(--k3)}
.plot .c4{--k:var(--k4)}.plot .c5{--k:var(--k5)}.plot .c6{--k:var(--k6)}.plot .c7{--k:var(--k7)}
.plot .grid path{stroke:var(--line);stroke-width:1;fill:none}.plot .grid .major{stroke:var(--mid)}
.plot .tick,.plot .axis{fill:var(--soft)}.plot .name{fill:var(--ink)}
.plot .band{fill:var(--k);opacity:.17}.plot .fan{fill:var(--k);opacity:.1}
.plot .line{fill:none;stroke:var(--k);stroke-width:2;stroke-linejoin:round;stroke-linecap:round}
.plot .dashed{stroke-dasharray:6 4}
.plot .dots{fill:var(--k);stroke:var(--paper);stroke-width:.8}.plot .dot{fill:var(--k)}
.plot .target{fill:none;stroke:var(--aim);stroke-width:1.5;stroke-dasharray:6 4}.plot .target-text{fill:var(--aim)}
.plot .ahead{fill:none;stroke:var(--k);stroke-width:2;stroke-dasharray:.1 6;stroke-linecap:round}
.plot .span{fill:none;stroke:var(--k);stroke-width:1.6}
@media print{.plot{--ink:#000;--soft:#444;--line:#eee;--mid:#ccc}}
)";
}

std::string svg_of(const LogPlot& plot) { return Drawing(plot).svg({}); }
std::string standalone_svg(const LogPlot& plot) { return Drawing(plot).svg(plot_css()) + "\n"; }

}  // namespace ls::report
