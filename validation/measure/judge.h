// The lines of the table of `lightshaft validate`: error probabilities, verdicts, and the table as text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ls::cases {

// A correct renderer fails any case of the whole table by chance with at most this probability. It is shared
// by all confidence intervals of the table (Sidak), whichever of them are run. It is a fifth of the total for
// all statistical tests of this project, tests/support/significance.h. The power of the tests is set by the
// band (the tolerated deviation), not by this level.
inline constexpr double kWrongVerdicts = 2e-4;

// A renderer that is off by more than the band in a case passes that case with at most this probability: two
// one-sided tests (Schuirmann 1987). It is not shared among cases, since the table passes only if every case
// does (an intersection-union test: Berger 1982); it is shared among a case's attempts.
inline constexpr double kWrongPass = 1e-3;

// The largest number of runs of one case. A case is run again, with more paths, if its interval came out too
// wide; each run counts as an interval of the table.
inline constexpr std::size_t kAttempts = 3;

// The relative error allowed for rounding. Radiance is float32: a path of n vertices multiplies about 10 n
// numbers, each rounded by 2^-24, and errors of many samples partly share their sign. The allowance is
// sufficient for paths of 25 vertices in the worst case.
inline constexpr double kRounding = 0x1p-16;

// The least degrees of freedom that a standard error must have: with fewer, a few pixels dominate it and it
// is not reliable. This is not required if the standard error is below the allowance for float32.
inline constexpr double kLeastFreedom = 40;

// The quick table uses bands wider by this factor, which need a tenth of the paths.
inline constexpr double kQuickWidening = 10. / 3;

// A case that needs more paths than this fails.
inline constexpr double kMostPaths = 1 << 27, kMostQuickPaths = 1 << 24;

}  // namespace ls::cases

namespace ls::cli {

// A line of the table, with its verdict.
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

// The table as text: its heading, and its lines.
std::string table_heading();
std::string table_line(const ValidateCase& c);
// Returns {"cases": [{name, expected, got, stderr, allowance, z, p, level, verdict, nonfinite, seconds,
// why}], "passed", "failed"}.
nlohmann::ordered_json table_json(const std::vector<ValidateCase>& cases);

}  // namespace ls::cli
