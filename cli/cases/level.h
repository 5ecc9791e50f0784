// The one place where the table says how sure it is.
#pragma once

#include <cstddef>

namespace ls::cases {

// A right renderer fails any case of the whole table by chance with this probability at most: shared by all
// intervals of the table (Sidak), whichever of them are run. A fifth of what all statistical tests of this
// project may be wrong by, tests/support/significance.h; power is the band's, not this level's.
inline constexpr double kWrongVerdicts = 2e-4;

// A renderer that is off by more than the band in a case passes that case with this probability at most: two
// one-sided tests (Schuirmann 1987). It is not shared among cases, since the table is passed only where each
// of them is (an intersection-union test: Berger 1982); among a case's attempts it is.
inline constexpr double kWrongPass = 1e-3;

// A case whose interval came out too wide is run anew with more paths, so often at most; each is an interval
// of the table's.
inline constexpr std::size_t kAttempts = 3;

// Radiance is float32: a path of n vertices multiplies about 10 n numbers, each rounded by 2^-24, and errors
// of many samples partly share their sign. Holds for paths of 25 vertices in the worst case.
inline constexpr double kRounding = 0x1p-16;

// Of the standard error: with fewer, a few pixels rule it and it is not believed. Not asked where the error
// is below what float32 is allowed.
inline constexpr double kLeastFreedom = 40;

// The quick table asks the same questions with bands wider by this factor: a tenth of the paths.
inline constexpr double kQuickWidening = 10. / 3;

// A case that would need more paths than this fails.
inline constexpr double kMostPaths = 1 << 27, kMostQuickPaths = 1 << 24;

}  // namespace ls::cases
