// Pearson's chi-square test of samples against a density, each at the level that significance.h gives to its
// family.
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

inline constexpr double kLeastExpected = 10;  // samples; cells with fewer are merged

// The tests of one share (a line of kShares in significance.h). close() checks their number and prints the
// smallest p that occurred, which is about 1 / n for n correct tests.
class ChiSquareTally {
 public:
  explicit ChiSquareTally(std::string_view file) : tests_(file) {}

  void expect(const std::string& name, std::span<const double> expected, std::span<const double> observed) {
    const cli::ChiSquare r = cli::chi_square(expected, observed, kLeastExpected);
    EXPECT_EQ(r.impossible, 0) << name << ": samples where the density is 0";
    EXPECT_GT(r.p, tests_.level()) << name << ": chi-square " << r.statistic << " of " << r.freedom
                                   << " degrees of freedom";
    if (r.p < least_) least_ = r.p, least_name_ = name;
  }
  // Call when all tests are done.
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
