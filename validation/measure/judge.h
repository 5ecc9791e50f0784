// A line of the table of `lightshaft validate`, with its verdict.
#pragma once

#include <cstdint>
#include <string>

namespace ls::cli {

struct ValidateCase {
  std::string name;
  double expected = 0, got = 0, standard_error = 0;
  // got - expected, in units of sqrt(standard error^2 + allowance^2); for chi-square tests in standard
  // errors.
  double z = 0;
  // Systematic deviation that is accepted: float32 rounding, and the uncertainty of the expected value.
  double allowance = 0;
  // p: the probability that a correct program gives a figure at least as far off. level: the p below which
  // the case fails.
  double p = 1, level = 0;
  // Statistical cases of the table are judged by two confidence intervals. The one at `band_level` must lie
  // within the band (the tolerated deviation around the answer), the one at `level` must contain the answer.
  double band_level = 0;
  std::uint64_t nonfinite = 0;  // number of faulty samples; a single one makes the case fail
  double seconds = 0;
  std::string why;  // reason of the failure; empty: the case passed
  // For the cases of the table: the rows of docs/measurements/stability.md that the case covers, a
  // one-sentence description, and the kind of test. In a "statistical" test `band` is the share of the answer
  // by which the interval may deviate, in an "exact" one the tolerance.
  std::string rows, about, kind;
  double band = 0;
  std::string why_band;  // reason for a wider band
  std::uint64_t paths = 0;
  // true if the case failed only because its interval is too wide, so that more paths may help
  bool too_wide = false;
  bool passed() const { return why.empty(); }
};

// Judges a case by its p: sets z, p, allowance and why. `freedom` is the degrees of freedom of the standard
// error, `rounding` the deviation allowed for float32 rounding. Without that allowance, a figure whose
// samples are all equal (standard error 0) would fail for an error of one ulp.
void judge(ValidateCase& c, double freedom, double rounding);

// Judges a case by two confidence intervals (equivalence test), with the standard error's `freedom` degrees
// of freedom. Both intervals are widened by `unknown`, the uncertainty of the answer. The interval at c.level
// must contain the answer, and the one at c.band_level must lie inside the band around it, so a case with too
// few samples fails. A case also fails if its standard error is above `rounding` and has fewer than `least`
// degrees of freedom.
void judge_equivalence(ValidateCase& c, double freedom, double unknown, double rounding, double least);

}  // namespace ls::cli
