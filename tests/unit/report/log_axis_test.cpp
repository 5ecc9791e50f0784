#include "util/report/log_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/unit/report/shown.h"

namespace ls::report {
namespace {

using Labels = std::vector<std::string>;

Labels labels(const LogAxis& axis, AxisUnit unit) {
  Labels all;
  for (const Tick& t : ticks(axis, unit))
    if (!t.label.empty()) all.push_back(t.label);
  return all;
}

TEST(LogAxis, EqualRatiosAreEqualDistances) {
  const LogAxis axis = log_axis(0.5, 700, 60, 504);

  const double step = axis.at(10) - axis.at(1);

  EXPECT_NEAR(axis.at(100) - axis.at(10), step, 1e-9 * step);
  EXPECT_NEAR(axis.at(2) - axis.at(1), step * std::log10(2.0), 1e-9 * step);
}

TEST(LogAxis, ValuesLieInsideWithAMargin) {
  const LogAxis axis = log_axis(0.5, 700, 60, 504);

  EXPECT_GT(axis.at(0.5), 60);
  EXPECT_LT(axis.at(700), 504);
}

TEST(LogAxis, UpwardAxisIsReversed) {
  const LogAxis axis = log_axis(0.001, 1, 300, 14);
  EXPECT_GT(axis.at(0.001), axis.at(1));
}

TEST(LogAxis, SingleValueGetsADecadeAroundIt) {
  const LogAxis axis = log_axis(3, 3, 0, 100);

  EXPECT_NEAR(std::log10(axis.hi / axis.lo), 1, 1e-12);
  EXPECT_NEAR(axis.at(3), 50, 1e-9);
}

TEST(LogAxis, StaysWithinTheRangeOfDoubles) {
  const LogAxis axis = log_axis(1e-308, 1e308, 0, 100);

  EXPECT_TRUE(std::isfinite(axis.hi) && axis.lo > 0);
  EXPECT_NEAR(axis.at(1), 50, 1e-9);
  for (const AxisUnit unit : {AxisUnit::seconds, AxisUnit::plain}) {
    EXPECT_LE(ticks(axis, unit).size(), 1000u);
    EXPECT_TRUE(ticks({1, std::numeric_limits<double>::infinity(), 0, 1}, unit).empty());
    EXPECT_TRUE(ticks({0, 1, 0, 1}, unit).empty());
  }
}

// The table is shared with the dashboard, whose ticks tests/web/test_modules.py compares with it.
TEST(Ticks, MatchTheTable) {
  for (const auto& [what, unit] :
       {std::pair("error_ticks", AxisUnit::plain), std::pair("time_ticks", AxisUnit::seconds)})
    for (const auto& row : shown(what))
      EXPECT_EQ(labels({row[0][0], row[0][1], 0, 1}, unit), row[1].get<Labels>()) << row;
}

TEST(Ticks, LinesBetweenDecadesAreThereButNotMajor) {
  const auto all = ticks({0.9, 1100, 0, 1}, AxisUnit::plain);

  EXPECT_EQ(std::count_if(all.begin(), all.end(), [](const Tick& t) { return t.major; }), 4);
  EXPECT_EQ(all.size(), 2 + 3 * 9);  // .9, 1 to 900, and 1000
  EXPECT_TRUE(
      std::is_sorted(all.begin(), all.end(), [](const Tick& a, const Tick& b) { return a.value < b.value; }));
}

TEST(Ticks, AxisHasAtLeastOneLabelAndNoMoreThanFit) {
  for (double lo = -6; lo < 6; lo += 0.37)
    for (double wide = 1; wide < 14; wide += 0.41) {
      const LogAxis axis{std::pow(10, lo), std::pow(10, lo + wide), 0, 1};
      for (const AxisUnit unit : {AxisUnit::plain, AxisUnit::seconds}) {
        const std::size_t n = labels(axis, unit).size();
        EXPECT_GE(n, 1u) << axis.lo << " to " << axis.hi;
        EXPECT_LE(n, 9u) << axis.lo << " to " << axis.hi;
      }
    }
}

}  // namespace
}  // namespace ls::report
