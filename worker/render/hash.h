// Integer mixing and counter-based random numbers.
#pragma once

#include <cmath>
#include <cstdint>

namespace ls::render {

// A bijection of 64-bit words whose every output bit depends on every input bit (the finaliser of SplitMix64,
// Steele, Lea and Flood 2014).
constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}
// combine(a, b), of b's mix64.
constexpr std::uint64_t combine_mixed(std::uint64_t a, std::uint64_t mixed_b) {
  return mix64(a + 0x9e3779b97f4a7c15ull + mixed_b);
}
constexpr std::uint64_t combine(std::uint64_t a, std::uint64_t b) { return combine_mixed(a, mix64(b)); }

// 32 random bits as a float in [0, 1); 24 bits are kept, so the largest value is 1 - 2^-24.
inline float unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }
// -log y of a uniform number y of which x = 1 - y is known as well, each to full relative precision: a share
// x of nearly 1 - e^-t of all numbers gives depths below t, however thin that is. y alone would not do: it is
// rounded near 1. One rounding of it changes log y and y - 1 alike (W. Kahan's log1p; Goldberg 1991, theorem
// 4), so that their ratio stays right, and no branch is needed that half of all calls would take.
inline float minus_log(float y, float x) {
  const float rest = 1 - y;  // exact for y >= 1/2
  return rest > 0 ? -std::log(y) * (x / rest) : x;
}
// An optical depth with density e^-t: -log((bits + .5) 2^-32). All 32 bits count, at both ends: never 0, from
// 2^-33 to 22.9 mean free paths (STABILITY N2, N5, N6).
inline float exponential(std::uint32_t bits) {
  return minus_log((static_cast<float>(bits) + .5f) * 0x1p-32f, (static_cast<float>(~bits) + .5f) * 0x1p-32f);
}

// Random numbers for trackers, which need an unknown count of them: word i is mix64(key + i * odd constant),
// a function of its key alone. Purposes have keys of their own, so that no use of numbers shifts another.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t key) : state_(key) {}
  std::uint64_t next() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }
  std::uint32_t bits() { return static_cast<std::uint32_t>(next() >> 32); }
  float uniform() { return unit_float(bits()); }
  // From 2^-54 to 37 mean free paths: 53 random bits.
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
