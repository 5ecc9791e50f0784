// Pearson's test that samples fall as a density says, and the share that each file's tests have in ONE rate
// of false alarms for the whole suite: all of them together reject a right program with the probability
// kSuiteFalsePositives (seeds are fixed, so that in fact they always or never do). The rate is split evenly
// by Sidak among as many tests as kShares announces; each file proves at its end that it ran just those.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::test {

inline constexpr double kSuiteFalsePositives = 1e-3;

struct Share {
  std::string_view file;
  int tests;
};
inline constexpr std::array kShares = {Share{"bsdf/sampling", 183},       Share{"sampling/phases", 20},
                                       Share{"sampling/lights", 18},      Share{"sampling/choice", 13},
                                       Share{"sampling/distances", 58},   Share{"sampling/film", 8},
                                       Share{"sampling/glow_points", 15}, Share{"render/envmap", 6},
                                       Share{"render/trackers", 1},       Share{"render/cylinder", 1}};

constexpr int all_tests() {
  int n = 0;
  for (const Share& s : kShares) n += s.tests;
  return n;
}
inline double false_positives_of_one_test() {
  return -std::expm1(std::log1p(-kSuiteFalsePositives) / all_tests());
}

// P(X > x) of the chi-square distribution: the upper regularised incomplete gamma function of (n / 2, x / 2),
// by its series below the mean and Lentz's continued fraction above; good to about 1e-12.
inline double chi_square_tail(double x, int freedom) {
  const double a = .5 * freedom, z = .5 * x;
  if (!(z > 0)) return 1;
  const double scale = std::exp(a * std::log(z) - z - std::lgamma(a));
  if (z < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 100000 && term > sum * 1e-16; ++n) sum += term *= z / (a + n);
    return std::max(0., 1 - scale * sum);
  }
  double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 100000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= c * d;
    if (std::abs(c * d - 1) < 1e-14) break;
  }
  return std::min(1., scale * h);
}

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
  r.p = chi_square_tail(r.statistic, r.freedom);
  return r;
}

// The tests of one share. When it goes (a static's or a fixture's end) it proves its number and says the
// least p that it has met: of n right tests about 1 / n.
class ChiSquareBook {
 public:
  explicit ChiSquareBook(std::string_view file) : file_(file) {}
  ChiSquareBook(const ChiSquareBook&) = delete;
  ChiSquareBook& operator=(const ChiSquareBook&) = delete;

  void expect(const std::string& name, std::span<const double> expected, std::span<const double> observed) {
    ++done_;
    const ChiSquare r = chi_square(expected, observed);
    EXPECT_EQ(r.impossible, "") << name;
    EXPECT_GT(r.p, false_positives_of_one_test())
        << name << ": chi-square " << r.statistic << " of " << r.freedom << " degrees of freedom";
    if (r.p < least_) least_ = r.p, least_name_ = name;
  }
  // To be called when all are done.
  void close() const {
    int announced = 0;
    for (const Share& s : kShares)
      if (s.file == file_) announced = s.tests;
    EXPECT_EQ(done_, announced) << "tests of " << file_ << ": put the number into kShares";
    std::printf("[   chi2   ] %s: %d tests, least p %.3g (%s), limit %.3g\n", std::string(file_).c_str(),
                done_, least_, least_name_.c_str(), false_positives_of_one_test());
  }

 private:
  std::string_view file_;
  std::string least_name_;
  double least_ = 1;
  int done_ = 0;
};

}  // namespace ls::test
