// Functions that mix integers, and random numbers computed from counters.
#pragma once

#include <cmath>
#include <cstdint>

namespace ls::render {

// A bijection of 64-bit words in which every output bit depends on every input bit (the finaliser of
// SplitMix64, Steele, Lea and Flood 2014).
constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}
// Returns combine(a, b), where mixed_b is mix64(b).
constexpr std::uint64_t combine_mixed(std::uint64_t a, std::uint64_t mixed_b) {
  return mix64(a + 0x9e3779b97f4a7c15ull + mixed_b);
}
constexpr std::uint64_t combine(std::uint64_t a, std::uint64_t b) { return combine_mixed(a, mix64(b)); }

// Turns 32 random bits into a float in [0, 1). The upper 24 bits are kept, so the largest value is 1 - 2^-24.
inline float unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }
// Returns -log y for a uniform number y. The caller passes y and its complement x = 1 - y, both with full
// relative precision. So optical depths below t occur with probability 1 - e^-t however small t is; y alone
// would not suffice, because near 1 it is rounded too coarsely. log y and 1 - y are both computed from the
// rounded y, and rounding changes them in the same proportion. So their ratio is correct, and its product
// with x is -log of the exact y (W. Kahan's log1p; Goldberg 1991, theorem 4). A separate formula for small
// depths would need a branch, which half of all calls would take.
inline float minus_log(float y, float x) {
  const float rest = 1 - y;  // exact for y >= 1/2
  return rest > 0 ? -std::log(y) * (x / rest) : x;
}
// Returns a random optical depth t with density e^-t: -log((bits + .5) 2^-32). All 32 bits contribute at
// small as well as at large depths: t is never 0 and is between 2^-33 and 22.9 mean free paths
// (docs/measurements/stability.md, N02 and N05).
inline float exponential(std::uint32_t bits) {
  return minus_log((static_cast<float>(bits) + .5f) * 0x1p-32f, (static_cast<float>(~bits) + .5f) * 0x1p-32f);
}

// A random stream of unbounded length, for trackers (algorithms that step through a medium from collision to
// collision): word i is mix64(key + i * odd constant), a function of the key alone. Each purpose of random
// numbers has its own key, so drawing more numbers for one purpose does not change those for another.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t key) : state_(key) {}
  std::uint64_t next() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }
  std::uint32_t bits() { return static_cast<std::uint32_t>(next() >> 32); }
  float uniform() { return unit_float(bits()); }
  // Returns a random optical depth with density e^-t, from 53 random bits: between 2^-54 and 37 mean free
  // paths.
  float exponential() {
    constexpr std::int64_t kTop = (std::int64_t{1} << 53) - 1;
    const auto bits = static_cast<std::int64_t>(next() >> 11);
    return minus_log((static_cast<float>(bits) + .5f) * 0x1p-53f,
                     (static_cast<float>(kTop - bits) + .5f) * 0x1p-53f);
  }

 private:
  std::uint64_t state_;
};

}  // namespace ls::render
