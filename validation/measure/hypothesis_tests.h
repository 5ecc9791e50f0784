// Distributions and tests that judge whether a measured figure agrees with the expected one: Student's t and
// Pearson's chi-square.
#pragma once

#include <cstddef>
#include <span>

namespace ls::cli {

// Returns the significance level for each of n independent checks. With it, a correct program fails at least
// one of the checks with probability `level` (Sidak): 1 - (1 - level)^(1/n).
double sidak(double level, std::size_t n);

// Returns P(|T| > |t|), where T has Student's t distribution with `freedom` degrees of freedom, which need
// not be whole.
double student_tails(double t, double freedom);

// Returns x with P(|T| > x) = p, where T has Student's t distribution; p is in (0, 1).
double student_quantile(double p, double freedom);

// Returns P(X > x), where X has the chi-square distribution with `freedom` degrees of freedom.
double chi2_tail(double x, double freedom);

// The result of Pearson's chi-square test of the numbers of samples in cells. The numbers in `expected` and
// `observed` have equal sums, except for samples that fall into no cell. Cells with fewer than `least`
// expected samples are merged, the smallest first, since the statistic follows the chi-square distribution
// only if the numbers are nearly normal.
struct ChiSquare {
  double statistic = 0, p = 1;
  int freedom = 1;
  double impossible = 0;  // number of samples in a cell where none is expected; 0 if it is at most `least`
};
ChiSquare chi_square(std::span<const double> expected, std::span<const double> observed, double least);

}  // namespace ls::cli
