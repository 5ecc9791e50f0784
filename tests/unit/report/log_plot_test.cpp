#include "util/report/log_plot.h"

#include <gtest/gtest.h>

#include <limits>
#include <pugixml.hpp>

namespace ls::report {
namespace {

LogPlot falling() {
  LogPlot plot;
  plot.id = "wall";
  plot.title = "Error against time";
  plot.curves.resize(1);
  plot.curves[0].name = "estimate";
  for (double s = 1; s < 1000; s *= 2) plot.curves[0].points.push_back({s, 0.5 / s, 0.4 / s, 0.6 / s});
  return plot;
}

// Parses the drawing as XML. If that fails, the test fails.
pugi::xml_document parsed(const std::string& svg) {
  pugi::xml_document document;
  const auto result = document.load_string(svg.c_str(), pugi::parse_full);
  EXPECT_TRUE(result) << result.description() << " at " << result.offset << " of\n" << svg;
  return document;
}

std::size_t count_of(const pugi::xml_document& svg, const char* path) {
  return svg.select_nodes(path).size();
}

// Returns the positions of the marks of a curve.
std::vector<std::pair<double, double>> marks(const pugi::xml_document& svg) {
  std::vector<std::pair<double, double>> all;
  for (const auto& node : svg.select_nodes("//g[starts-with(@class,'dots')]/path[title]")) {
    double x = 0, y = 0;
    EXPECT_EQ(std::sscanf(node.node().attribute("d").value(), "M%lf %lf", &x, &y), 2);
    all.emplace_back(x, y);
  }
  return all;
}

TEST(LogPlot, ErrorThatFallsAsOneOverTimeIsAStraightLineDownwards) {
  const auto points = marks(parsed(svg_of(falling())));

  ASSERT_EQ(points.size(), 10u);
  const double dx = points[1].first - points[0].first, dy = points[1].second - points[0].second;
  EXPECT_GT(dx, 0);
  EXPECT_GT(dy, 0);  // downwards
  for (std::size_t i = 2; i < points.size(); ++i) {
    EXPECT_NEAR(points[i].first - points[i - 1].first, dx, 0.11);  // coordinates have one decimal
    EXPECT_NEAR(points[i].second - points[i - 1].second, dy, 0.11);
  }
}

TEST(LogPlot, HasANameAndSummaryForScreenReaders) {
  LogPlot plot = falling();
  plot.summary = "relMSE 0.001 after 8.5 min";
  const auto svg = parsed(svg_of(plot));

  EXPECT_STREQ(svg.child("svg").attribute("role").value(), "img");
  EXPECT_STREQ(svg.child("svg").attribute("aria-labelledby").value(), "wall-t wall-d");
  EXPECT_STREQ(svg.child("svg").child("desc").text().get(), "relMSE 0.001 after 8.5 min");
  EXPECT_STREQ(svg.select_node("//g[@class='dots c0']/path/title").node().text().get(),
               "0.500 (0.400 to 0.600) at 1 s");
}

TEST(LogPlot, ForeignNamesAreEscaped) {
  LogPlot plot = falling();
  plot.id = "x\" onload=\"y";
  plot.title = plot.summary = plot.x_title = plot.y_title = plot.curves[0].name =
      "</title><script>alert('&')</script>";
  // The legend with the names is drawn only for several curves.
  plot.curves.push_back(plot.curves[0]);
  const auto svg = parsed(svg_of(plot));

  EXPECT_EQ(count_of(svg, "//script"), 0u);
  EXPECT_EQ(count_of(svg, "//*[@onload]"), 0u);
  EXPECT_STREQ(svg.child("svg").child("title").text().get(), plot.title.c_str());
  EXPECT_STREQ(svg.select_node("//text[@class='name']").node().text().get(), plot.title.c_str());
}

TEST(LogPlot, ValuesWithoutALogarithmAreLeftOut) {
  LogPlot plot = falling();
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  plot.curves[0].points.insert(plot.curves[0].points.begin(),
                               {{0, 1}, {1, 0}, {-1, 1}, {nan, 1}, {1, nan}, {inf, 1}, {1, inf}});
  plot.curves[0].points.push_back({1024, 0.0005, nan, inf});
  const std::string svg = svg_of(plot);

  EXPECT_EQ(marks(parsed(svg)).size(), 11u);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(LogPlot, SaysWhenTheFirstPointWillComeIfThereIsNone) {
  LogPlot plot = falling();
  plot.curves[0].points.clear();
  plot.target = 0.001;
  plot.ahead = Ahead{10, 9, 11};
  const auto svg = parsed(svg_of(plot));

  EXPECT_EQ(count_of(svg, "//path"), 0u);
  EXPECT_EQ(count_of(svg, "//text"), 1u);
}

TEST(LogPlot, TargetAndForecastMeetWhereTheErrorWillBe) {
  LogPlot plot = falling();
  plot.target = 1e-4;
  plot.ahead = Ahead{5000, 4000, 7000};
  const auto svg = parsed(svg_of(plot));

  double x = 0, y = 0, across = 0, span_x = 0, span_y = 0;
  std::sscanf(svg.select_node("//path[@class='dot c0']").node().attribute("d").value(), "M%lf %lf", &x, &y);
  std::sscanf(svg.select_node("//path[@class='target']").node().attribute("d").value(), "M60 %lf", &across);
  std::sscanf(svg.select_node("//path[@class='span c0']").node().attribute("d").value(), "M%lf %lf", &span_x,
              &span_y);

  EXPECT_NEAR(y + 5, across, 0.11);  // half of the height of the mark
  EXPECT_NEAR(span_y + 5, across, 0.11);
  EXPECT_LT(span_x, x);
}

TEST(LogPlot, ForecastWithoutATargetOrTooFarAwayIsNotDrawn) {
  LogPlot plot = falling();
  plot.ahead = Ahead{5000, 4000, 7000};
  EXPECT_EQ(count_of(parsed(svg_of(plot)), "//path[@class='dot c0']"), 0u);

  plot.target = 1e-9;
  plot.ahead = Ahead{1e9, 1e8, 1e10};
  EXPECT_EQ(count_of(parsed(svg_of(plot)), "//path[@class='dot c0']"), 0u);
}

TEST(LogPlot, SeveralCurvesHaveALegendAndDifferentMarks) {
  LogPlot plot = falling();
  for (int i = 1; i < 6; ++i) plot.curves.push_back(plot.curves[0]);
  const auto svg = parsed(svg_of(plot));

  EXPECT_EQ(count_of(svg, "//text[@class='name']"), 6u);
  EXPECT_EQ(count_of(svg, "//polygon[starts-with(@class,'band')]"), 6u);
  EXPECT_EQ(count_of(parsed(svg_of(falling())), "//text[@class='name']"), 0u);
}

TEST(LogPlot, LongCurvesAreThinnedToTheirEnds) {
  LogPlot plot = falling();
  plot.curves[0].points.clear();
  for (int i = 1; i <= 100000; ++i) plot.curves[0].points.push_back({1.0 * i, 1.0 / i});
  const auto points = marks(parsed(svg_of(plot)));

  EXPECT_EQ(points.size(), kMostCurvePoints);
}

TEST(LogPlot, StandaloneFileContainsItsStyle) {
  const auto svg = parsed(standalone_svg(falling()));

  EXPECT_EQ(count_of(svg, "/svg/style"), 1u);
  EXPECT_EQ(count_of(parsed(svg_of(falling())), "/svg/style"), 0u);
}

}  // namespace
}  // namespace ls::report
