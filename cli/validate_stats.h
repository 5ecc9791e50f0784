// Significance: what a measured figure with a standard error says about an expected one.
#pragma once

#include <cstddef>

namespace ls::cli {

// Of each of n independent checks, so that a right program fails any of them with probability `level`
// (Sidak): 1 - (1 - level)^(1/n).
double sidak(double level, std::size_t n);

// P(|T| > |t|) for Student's t of `freedom` degrees, which need not be whole.
double student_tails(double t, double freedom);

// x with P(|T| > x) = p, for p in (0, 1).
double student_quantile(double p, double freedom);

// P(X > x) for chi-square of `freedom` degrees.
double chi2_tail(double x, double freedom);

}  // namespace ls::cli
