// Statistical significance of a measured figure with a standard error against an expected one.
#pragma once

#include <cstddef>

namespace ls::cli {

// The level for each of n independent checks such that a correct program fails any of them with probability
// `level` (Sidak): 1 - (1 - level)^(1/n).
double sidak(double level, std::size_t n);

// P(|T| > |t|) for Student's t with `freedom` degrees of freedom, which need not be whole.
double student_tails(double t, double freedom);

// x with P(|T| > x) = p, for p in (0, 1).
double student_quantile(double p, double freedom);

// P(X > x) for chi-square with `freedom` degrees of freedom.
double chi2_tail(double x, double freedom);

}  // namespace ls::cli
