#include "tests/property/dice.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace ls::test {

std::uint64_t Dice::next() {
  state_ += 0x9e3779b97f4a7c15;
  std::uint64_t x = state_;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

double Dice::unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

double Dice::magnitude(double a, double b) { return std::exp(between(std::log(a), std::log(b))); }

double Dice::gauss() {
  const double r = std::sqrt(-2 * std::log(unit() + 0x1p-54)), phi = 6.283185307179586 * unit();
  return r * std::cos(phi);
}

double Dice::tame(const scene::Range& range) {
  if (std::isfinite(range.min) && std::isfinite(range.max)) {
    const double width = range.max - range.min;
    // Wide ranges are limits of what can be computed, not of what is meant.
    if (width <= 400) return range.min + width * between(.02, .98);
    return std::clamp(magnitude(1, 20), range.min, range.max);
  }
  if (std::isfinite(range.min)) return std::max(range.min, 0.) + magnitude(.1, 4);
  return between(-2, 2);
}

double Dice::extreme(const scene::Range& range) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::array<double, 34> all{range.min,
                                   range.max,
                                   std::nextafter(range.min, kInf),
                                   std::nextafter(range.max, -kInf),
                                   0,
                                   -0.,
                                   1,
                                   1 - 0x1p-24,
                                   1 - 1e-7,
                                   1 - 1e-4,
                                   1 + 1e-6,
                                   -1 + 1e-4,
                                   4.9e-324,
                                   1e-310,
                                   1e-45,
                                   1e-40,
                                   1e-38,
                                   1e-30,
                                   1e-20,
                                   1e-12,
                                   1e-8,
                                   1e-6,
                                   1e-4,
                                   1e-3,
                                   100,
                                   1e4,
                                   1e5,
                                   1e6,
                                   1e8,
                                   1e12,
                                   1e20,
                                   1e30,
                                   -1e6,
                                   1.7e308};
  for (int tries = 0; tries < 100; ++tries) {
    const double x = all[below(all.size())];
    if (std::isfinite(x) && range.contains(x)) return x;
  }
  return tame(range);
}

}  // namespace ls::test
