// The lines of the table that `lightshaft validate` prints: the error probabilities behind their verdicts,
// the verdicts, and the table as text and as JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ls::cases {

// The probability that a correct renderer fails one or more cases of the whole table by chance is at most
// this. It is shared by all confidence intervals of the table (Sidak), whichever of them are run. It is a
// fifth of the probability for all statistical tests of this project (tests/support/significance.h). The
// power of the tests is set by the band (the tolerated deviation), not by this level.
inline constexpr double kWrongVerdicts = 2e-4;

// If the renderer is off by more than the band in a case, the case passes with at most this probability, by
// two one-sided tests (Schuirmann 1987). The probability is not divided among cases, since the table passes
// only if every case does (an intersection-union test: Berger 1982). It is divided among the attempts of a
// case.
inline constexpr double kWrongPass = 1e-3;

// The largest number of attempts (runs) of one case. A case is run again, with more paths, if its confidence
// interval is too wide. For kWrongVerdicts each attempt counts as an interval of the table.
inline constexpr std::size_t kAttempts = 3;

// The relative error allowed for rounding. Radiance is float32. A path of n vertices multiplies about 10 n
// numbers, each rounded by 2^-24, and the errors of many samples partly have the same sign. The allowance is
// sufficient for paths of 25 vertices in the worst case.
inline constexpr double kRounding = 0x1p-16;

// The least degrees of freedom that a standard error must have: with fewer, a few pixels dominate it and it
// is not reliable. A standard error below the allowance for float32 rounding need not fulfil this.
inline constexpr double kLeastFreedom = 40;

// With --quick the bands are wider by this factor, so a tenth of the paths suffices.
inline constexpr double kQuickWidening = 10. / 3;

// The largest number of paths of a run, without and with --quick. A case that would need more fails.
inline constexpr double kMostPaths = 1 << 27, kMostQuickPaths = 1 << 24;

}  // namespace ls::cases

namespace ls::cli {

// A line of the table, with its verdict.
struct ValidateCase {
  std::string name;
  double expected = 0, got = 0, standard_error = 0;
  // got - expected, in units of sqrt(standard_error^2 + allowance^2). For chi-square tests the unit is
  // standard_error.
  double z = 0;
  // Systematic deviation that is accepted: float32 rounding, and the uncertainty of the expected value.
  double allowance = 0;
  // p: the probability that a correct program gives a figure at least as far from `expected` as `got` is.
  // level: the case fails if p is below this level.
  double p = 1, level = 0;
  // Statistical cases of the table are judged by two confidence intervals. The one at `band_level` must lie
  // within the band (the tolerated deviation around the answer), the one at `level` must contain the answer.
  double band_level = 0;
  std::uint64_t nonfinite = 0;  // number of faulty samples; a single one makes the case fail
  double seconds = 0;
  std::string why;  // reason of a failure; empty: the case passed
  // Only for the cases of the table, not for those of Nori files. rows: the rows of
  // docs/measurements/stability.md that the case covers. about: a description in one sentence. kind:
  // "statistical" (then `band` is the share of the answer by which the confidence interval may deviate) or
  // "exact" (then `band` is the tolerance).
  std::string rows, about, kind;
  double band = 0;
  std::string why_band;  // reason for a band wider than the default
  std::uint64_t paths = 0;
  // True if the case failed only because its confidence interval is too wide or its standard error is not
  // reliable, so that more paths may help.
  bool too_wide = false;
  bool passed() const { return why.empty(); }
};

// Judges a case by its p: sets z, p, allowance and why. `freedom` is the number of degrees of freedom of the
// standard error, `rounding` the deviation allowed for float32 rounding. Without that allowance, a figure
// whose samples are all equal (standard error 0) would fail for an error of one ulp.
void judge(ValidateCase& c, double freedom, double rounding);

// Judges a case by two confidence intervals (equivalence test). `freedom` is the number of degrees of freedom
// of the standard error. Both intervals are widened by `unknown`, the uncertainty of the answer. The interval
// at c.level must contain the answer. The interval at c.band_level must lie inside the band around the
// answer, so a case with too few samples fails. A case also fails if its standard error is above `rounding`
// and has fewer than `least` degrees of freedom.
void judge_equivalence(ValidateCase& c, double freedom, double unknown, double rounding, double least);

// These return the heading of the table and one of its lines, as text without a line break.
std::string table_heading();
std::string table_line(const ValidateCase& c);
// Returns {"cases": [{name, expected, got, stderr, allowance, z, p, level, verdict, nonfinite, seconds,
// why}], "passed", "failed"}. Cases of the table also have rows, about, kind, band (or tolerance), why_band
// and paths.
nlohmann::ordered_json table_json(const std::vector<ValidateCase>& cases);

}  // namespace ls::cli
