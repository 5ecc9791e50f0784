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
constexpr std::uint64_t combine(std::uint64_t a, std::uint64_t b) {
  return mix64(a + 0x9e3779b97f4a7c15ull + mix64(b));
}

// 32 random bits as a float in [0, 1); 24 bits are kept, so the largest value is 1 - 2^-24.
inline float unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }
// -log of a uniform number in (0, 1]: an optical depth, finite for all inputs and exactly 0 only at bits =
// 2^32 - 1. All 32 bits count, so that tails reach 22 mean free paths (STABILITY N5, N6).
inline float exponential(std::uint32_t bits) {
  return -std::log((static_cast<float>(bits) + 1.f) * 0x1p-32f);
}

// Random numbers for trackers, which need an unknown count of them: word i is mix64(key + i * odd constant),
// a function of its key alone. Purposes have keys of their own, so that no use of numbers shifts another.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t key) : state_(key) {}
  std::uint64_t next() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }
  std::uint32_t bits() { return static_cast<std::uint32_t>(next() >> 32); }
  float uniform() { return unit_float(bits()); }
  // Reaches 36 mean free paths: 53 random bits.
  float exponential() { return -std::log(static_cast<float>((next() >> 11) + 1) * 0x1p-53f); }

 private:
  std::uint64_t state_;
};

}  // namespace ls::render
