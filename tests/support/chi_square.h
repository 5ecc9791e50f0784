// Pearson's test that samples fall as a density says, each at the level that significance.h gives its family.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/significance.h"
#include "validation/measure/hypothesis_tests.h"

namespace ls::test {

struct ChiSquare {
  double statistic = 0, p = 1;
  int freedom = 0;
  std::string impossible;  // samples where there is no density at all, more than edges of cells explain
};

// `expected` and `observed`: counts by cell, of equal sums but for what falls into no cell. Rare cells are
// put together, the rarest first, until kLeastExpected samples are expected in each: chi-square is a
// statement about counts that are nearly normal.
inline constexpr double kLeastExpected = 10;
inline ChiSquare chi_square(std::span<const double> expected, std::span<const double> observed) {
  std::vector<std::size_t> order(expected.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return expected[a] < expected[b]; });
  ChiSquare r;
  double e = 0, o = 0, last_e = 0, last_o = 0;
  int cells = 0;
  const auto add = [&](double want, double got) { r.statistic += (got - want) * (got - want) / want; };
  for (const std::size_t i : order) {
    e += std::max(0., expected[i]);
    o += observed[i];
    if (e < kLeastExpected) continue;
    add(e, o);
    last_e = e;
    last_o = o;
    e = o = 0;
    ++cells;
  }
  if (e > 0 || o > 0) {  // too few for a cell of their own: they go to the last one
    if (cells == 0) {
      if (!(e > 0)) r.impossible = fmt::format("{} samples where the density is 0", o);
      return r;
    }
    r.statistic -= (last_o - last_e) * (last_o - last_e) / last_e;
    add(last_e + e, last_o + o);
  }
  for (std::size_t i = 0; i < expected.size(); ++i)
    if (expected[i] <= 0 && observed[i] > kLeastExpected)
      r.impossible = fmt::format("{} samples in a cell where the density is 0", observed[i]);
  r.freedom = std::max(1, cells - 1);
  r.p = cli::chi2_tail(r.statistic, r.freedom);
  return r;
}

// The tests of one share. At their end they prove their number and say the least p that they have met: of n
// right tests about 1 / n.
class ChiSquareTally {
 public:
  explicit ChiSquareTally(std::string_view file) : tests_(file) {}

  void expect(const std::string& name, std::span<const double> expected, std::span<const double> observed) {
    const ChiSquare r = chi_square(expected, observed);
    EXPECT_EQ(r.impossible, "") << name;
    EXPECT_GT(r.p, tests_.level()) << name << ": chi-square " << r.statistic << " of " << r.freedom
                                   << " degrees of freedom";
    if (r.p < least_) least_ = r.p, least_name_ = name;
  }
  // To be called when all are done.
  void close() const {
    tests_.close();
    EXPECT_EQ(tests_.done(), tests_.announced());
    std::printf("[   chi2   ] least p %.3g (%s)\n", least_, least_name_.c_str());
  }

 private:
  Tests tests_;
  std::string least_name_;
  double least_ = 1;
};

}  // namespace ls::test
