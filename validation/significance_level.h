// The error probabilities of the table.
#pragma once

#include <cstddef>

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
