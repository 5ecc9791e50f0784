// Whether two renders have the same mean: a first look with few samples, and where it is suspicious a second
// with fresh numbers and more, which alone decides.
#pragma once

#include <string>

#include "tests/support/render_check.h"
#include "tests/support/significance.h"

namespace ls::test {

enum class Verdict { alike, undecided, different };
struct Comparison {
  Verdict verdict = Verdict::alike;
  std::string told;
};

// Of two estimates; a right renderer is called different with probability `level` at most, for each channel:
// three tests.
Comparison compare(const Estimate& a, const Estimate& b, double level);

struct Looks {
  std::uint64_t first = 64, second = 1024;  // samples per pixel
};
Comparison look(const SceneBuilder& a, const SceneBuilder& b, std::uint64_t seed, double level,
                Looks looks = {});

}  // namespace ls::test
