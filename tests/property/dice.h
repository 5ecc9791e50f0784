// Where random scenes get their numbers: a seeded stream, and what is drawn from a range of describe.h.
#pragma once

#include <cstdint>

#include "core/scene/schema/describe.h"

namespace ls::test {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next();  // splitmix64
  double unit();         // in [0, 1)
  double between(double a, double b) { return a + (b - a) * unit(); }
  double magnitude(double a, double b);  // between two positive numbers, evenly in the logarithm
  bool chance(double p) { return unit() < p; }
  std::size_t below(std::size_t n) { return next() % n; }
  double gauss();  // about 0, of variance 1

  // In the middle of a range.
  double tame(const scene::Range& range);
  // At its ends, zero, denormal, tiny, huge: a value that the range contains.
  double extreme(const scene::Range& range);

 private:
  std::uint64_t state_;
};

}  // namespace ls::test
