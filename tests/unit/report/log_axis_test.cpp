#include "common/report/log_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ls::report {
namespace {

std::vector<std::string> labels(const LogAxis& axis, AxisUnit unit) {
  std::vector<std::string> all;
  for (const Tick& t : ticks(axis, unit))
    if (!t.label.empty()) all.push_back(t.label);
  return all;
}

using Labels = std::vector<std::string>;

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

TEST(LogAxis, AxisThatRunsUpwardsIsTurnedRound) {
  const LogAxis axis = log_axis(0.001, 1, 300, 14);
  EXPECT_GT(axis.at(0.001), axis.at(1));
}

TEST(LogAxis, OneValueHasADecadeAroundIt) {
  const LogAxis axis = log_axis(3, 3, 0, 100);

  EXPECT_NEAR(std::log10(axis.hi / axis.lo), 1, 1e-12);
  EXPECT_NEAR(axis.at(3), 50, 1e-9);
}

TEST(LogAxis, TheEndsOfDoublesAreNotLeft) {
  const LogAxis axis = log_axis(1e-308, 1e308, 0, 100);

  EXPECT_TRUE(std::isfinite(axis.hi) && axis.lo > 0);
  EXPECT_NEAR(axis.at(1), 50, 1e-9);
  for (const AxisUnit unit : {AxisUnit::seconds, AxisUnit::plain}) {
    EXPECT_LE(ticks(axis, unit).size(), 1000u);
    EXPECT_TRUE(ticks({1, std::numeric_limits<double>::infinity(), 0, 1}, unit).empty());
    EXPECT_TRUE(ticks({0, 1, 0, 1}, unit).empty());
  }
}

TEST(Ticks, OfALongAxisAreDecades) {
  EXPECT_EQ(labels({1e-5, 2, 0, 1}, AxisUnit::plain), (Labels{"10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "1"}));
}

TEST(Ticks, OfAShortAxisHaveTwoAndFiveBetween) {
  EXPECT_EQ(labels({0.009, 0.3, 0, 1}, AxisUnit::plain), (Labels{"0.01", "0.02", "0.05", "0.1", "0.2"}));
  EXPECT_EQ(labels({9e-6, 6e-5, 0, 1}, AxisUnit::plain), (Labels{"10⁻⁵", "2·10⁻⁵", "5·10⁻⁵"}));
}

TEST(Ticks, LinesBetweenDecadesAreThereButNotMajor) {
  const auto all = ticks({0.9, 1100, 0, 1}, AxisUnit::plain);

  EXPECT_EQ(std::count_if(all.begin(), all.end(), [](const Tick& t) { return t.major; }), 4);
  EXPECT_EQ(all.size(), 2 + 3 * 9);  // .9, then 1 to 1000
  EXPECT_TRUE(
      std::is_sorted(all.begin(), all.end(), [](const Tick& a, const Tick& b) { return a.value < b.value; }));
}

TEST(Ticks, TimesAreThoseThatPeopleCountIn) {
  EXPECT_EQ(labels({0.7, 300, 0, 1}, AxisUnit::seconds),
            (Labels{"1 s", "2 s", "5 s", "10 s", "20 s", "1 min", "2 min", "5 min"}));
  EXPECT_EQ(labels({0.5, 90000, 0, 1}, AxisUnit::seconds),
            (Labels{"1 s", "10 s", "1 min", "10 min", "1 h", "10 h", "1 d"}));
}

TEST(Ticks, ThereAreNeverMoreLabelsThanHaveRoomAndNeverNone) {
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
