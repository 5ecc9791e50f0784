// Four-dimensional Sobol points with hash-based Owen scrambling and nested uniform shuffling (Burley,
// "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Direction numbers of Joe and Kuo 2008 for
// dimensions 1 to 4.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/hash.h"

namespace ls::render {

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// An Owen scramble in bit-reversed order: bit i of the result depends on bits 0..i only (Laine and Karras
// 2011, with the constants of Vegdahl 2021).
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

namespace detail {

// Direction numbers v[d][bit] for dimensions 1..3 (dimension 0 is the bit reversal of the index), from the
// primitive polynomials and initial m of Joe and Kuo's table: (s, a, m) = (1, 0, {1}), (2, 1, {1, 3}), (3, 1,
// {1, 3, 1}).
constexpr std::array<std::array<std::uint32_t, 32>, 3> direction_numbers() {
  constexpr std::uint32_t kInitial[3][3] = {{1, 0, 0}, {1, 3, 0}, {1, 3, 1}};
  constexpr int kDegree[3] = {1, 2, 3};
  constexpr std::uint32_t kPoly[3] = {0, 1, 1};
  std::array<std::array<std::uint32_t, 32>, 3> v{};
  for (int d = 0; d < 3; ++d) {
    const int s = kDegree[d];
    for (int i = 0; i < s; ++i) v[d][i] = kInitial[d][i] << (31 - i);
    for (int i = s; i < 32; ++i) {
      v[d][i] = v[d][i - s] ^ (v[d][i - s] >> s);
      for (int k = 1; k < s; ++k) {
        if ((kPoly[d] >> (s - 1 - k)) & 1) v[d][i] ^= v[d][i - k];
      }
    }
  }
  return v;
}

// XOR of direction numbers for each value of each byte of the index, already bit-reversed: point bits in
// reversed order are what the scramble wants.
struct SobolTables {
  std::uint32_t value[3][4][256];
};
constexpr SobolTables sobol_tables() {
  const auto v = direction_numbers();
  SobolTables t{};
  for (int d = 0; d < 3; ++d) {
    for (int byte = 0; byte < 4; ++byte) {
      for (unsigned k = 0; k < 256; ++k) {
        std::uint32_t x = 0;
        for (int bit = 0; bit < 8; ++bit) {
          if ((k >> bit) & 1) x ^= v[d][8 * byte + bit];
        }
        t.value[d][byte][k] = reverse_bits(x);
      }
    }
  }
  return t;
}
inline constexpr SobolTables kSobol = sobol_tables();

inline std::uint32_t sobol_reversed(std::uint32_t index, int d) {
  const auto& t = kSobol.value[d];
  return t[0][index & 255] ^ t[1][(index >> 8) & 255] ^ t[2][(index >> 16) & 255] ^ t[3][index >> 24];
}

}  // namespace detail

// Four coordinates of point `index` of the sequence named by `key`, as 32-bit fractions.
inline std::array<std::uint32_t, 4> sobol4(std::uint32_t index, std::uint64_t key) {
  const auto shuffle_seed = static_cast<std::uint32_t>(key);
  const std::uint32_t i = reverse_bits(scramble_reversed(reverse_bits(index), shuffle_seed));
  const std::uint64_t k1 = mix64(key), k2 = mix64(key + 1);
  return {
      reverse_bits(scramble_reversed(i, static_cast<std::uint32_t>(k1))),
      reverse_bits(scramble_reversed(detail::sobol_reversed(i, 0), static_cast<std::uint32_t>(k1 >> 32))),
      reverse_bits(scramble_reversed(detail::sobol_reversed(i, 1), static_cast<std::uint32_t>(k2))),
      reverse_bits(scramble_reversed(detail::sobol_reversed(i, 2), static_cast<std::uint32_t>(k2 >> 32)))};
}

}  // namespace ls::render
