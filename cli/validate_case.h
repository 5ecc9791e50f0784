// A line of the table that `lightshaft validate` fills, and its verdict.
#pragma once

#include <cstdint>
#include <string>

namespace ls::cli {

struct ValidateCase {
  std::string name;
  double expected = 0, got = 0, standard_error = 0;
  // got - expected, in units of sqrt(standard error^2 + allowance^2); of chi-square tests in standard errors.
  double z = 0;
  // How far off a figure may be without chance: what float32 does to it, and what its answer leaves out.
  double allowance = 0;
  // How probable a figure at least as far off is if the program is right; and below which it is not believed.
  double p = 1, level = 0;
  double band_level =
      0;  // of the interval that must lie within the band; `level` is that of what must cover the answer
  std::uint64_t nonfinite = 0;  // samples that went wrong: with any the case fails
  double seconds = 0;
  std::string why;  // of a failure
  // Of the table's own cases: what they answer, in a sentence; "statistical", with the share of the answer
  // that the interval must lie within, or "exact", with the tolerance of the figure.
  std::string rows, about, kind;
  double band = 0;
  std::string why_band;  // of a band that is wider than others
  std::uint64_t paths = 0;
  bool too_wide = false;  // failed for the interval's width alone: more paths may help
  bool passed() const { return why.empty(); }
};

// What a case says once its figures are known: fills z, p, allowance and why. `freedom`: of the standard
// error. Up to `rounding` off is what float32 may do to a figure whose every sample is the same.
void judge(ValidateCase& c, double freedom, double rounding);

// Equivalence: the interval at the case's level, made wider by `unknown`, covers the answer, and the one at
// its band_level lies inside the band around it; too few samples fail. A standard error above `rounding` of
// fewer than `least` degrees of freedom is not believed.
void judge_equivalence(ValidateCase& c, double freedom, double unknown, double rounding, double least);

}  // namespace ls::cli
