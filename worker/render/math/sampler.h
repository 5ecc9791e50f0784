// The random numbers of one sample of a pixel. They are a pure function of (seed, pixel, sample index,
// branch, vertex, purpose), where a branch is one of the paths into which a path splits. Even sample indices
// form half A, odd ones half B (the error is estimated by comparing them); each half of each pixel is its own
// scrambled Sobol sequence.
//
// Sobol points have four dimensions, hash-based Owen scrambling and nested uniform shuffling (Burley,
// "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020), and the direction numbers of Joe and Kuo 2008 for
// dimensions 1 to 4.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "worker/render/math/random.h"

namespace ls::render {

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Owen scrambling in bit-reversed order: bit i of the result depends only on bits 0 to i of x (Laine and
// Karras 2011, with the constants of Vegdahl 2021). U is a 32-bit word or a vector of such words.
template <class U>
constexpr U scramble_reversed(U x, U seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

namespace detail {

// Direction numbers v[d][bit] for dimensions 2 to 4, which are d = 0 to 2 (dimension 1 is the bit reversal of
// the index). They follow from the degrees s, the primitive polynomials a and the initial numbers m of Joe
// and Kuo's table: (s, a, m) = (1, 0, {1}), (2, 1, {1, 3}), (3, 1, {1, 3, 1}).
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

using U32x4 = std::uint32_t __attribute__((vector_size(16)));
using U64x2 = std::uint64_t __attribute__((vector_size(16)));
using U8x16 = std::uint8_t __attribute__((vector_size(16)));

// Reverses the bits of each of the four words, by table lookup of half bytes.
inline U32x4 reverse_bits(U32x4 x) {
  constexpr U8x16 kNibble = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15}, kUpper = kNibble << 4;
  constexpr U8x16 kBytes = {3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12};
  const auto bytes = __builtin_shuffle(reinterpret_cast<U8x16>(x), kBytes);
  return reinterpret_cast<U32x4>(__builtin_shuffle(kUpper, bytes & 15) |
                                 __builtin_shuffle(kNibble, bytes >> 4));
}

// value[b][k] is the contribution, by XOR, of byte b of the bit-reversed index to the four coordinates if
// that byte has the value k. The coordinates are bit-reversed too, as scramble_reversed() needs them.
struct SobolTables {
  alignas(16) std::uint32_t value[4][256][4];
};
constexpr SobolTables sobol_tables() {
  const auto v = direction_numbers();
  SobolTables t{};
  for (int byte = 0; byte < 4; ++byte) {
    for (std::uint32_t k = 0; k < 256; ++k) {
      const std::uint32_t index = ls::render::reverse_bits(k << (8 * byte));
      t.value[byte][k][0] = index;  // the first coordinate is the reversed index
      for (int d = 0; d < 3; ++d) {
        std::uint32_t x = 0;
        for (int bit = 0; bit < 32; ++bit) {
          if ((index >> bit) & 1) x ^= v[d][bit];
        }
        t.value[byte][k][d + 1] = ls::render::reverse_bits(x);
      }
    }
  }
  return t;
}
inline constexpr SobolTables kSobol = sobol_tables();

inline U32x4 sobol_reversed(std::uint32_t reversed_index) {
  const std::size_t index = reversed_index;
  // The value of byte number `byte` of the index selects a row of 16 bytes.
  const auto row = [&](int byte) {
    const std::size_t at = (byte == 0 ? index << 4 : index >> (8 * byte - 4)) & 0xff0;
    return *reinterpret_cast<const U32x4*>(reinterpret_cast<const char*>(kSobol.value[byte]) + at);
  };
  return row(0) ^ row(1) ^ row(2) ^ row(3);
}

}  // namespace detail

// Returns the four coordinates, as 32-bit fractions, of one point of the scrambled sequence that `key`
// identifies. `reversed_index` is the index of the point with its bits reversed.
inline std::array<std::uint32_t, 4> sobol4_reversed(std::uint32_t reversed_index, std::uint64_t key) {
  const std::uint32_t i = scramble_reversed(reversed_index, static_cast<std::uint32_t>(key));
  const detail::U64x2 seeds = {mix64(key), mix64(key + 1)};
  return std::bit_cast<std::array<std::uint32_t, 4>>(detail::reverse_bits(
      scramble_reversed(detail::sobol_reversed(i), reinterpret_cast<detail::U32x4>(seeds))));
}

// The purpose of a group of random numbers. The values determine the bits of the image, so existing values
// must not change: a new purpose gets a new value.
enum class Purpose : std::uint32_t {
  camera,
  hero,
  flight,
  light,
  direction,
  segment,
  track_flight,
  track_shadow,
  track_segment,
  null_transmission,
  emission,
  distance,
  track_distance,
  overlap,
  overlap_emission,
  albedo,
  guide,
  track_guide,
  connect,
  track_connect,
  track_opacity,
  track_direct,
  shadow_catcher,
  track_shadow_catcher,
  emissive,
  track_emissive,
  end  // not a purpose, but the number of purposes
};

// Four random numbers for one purpose at one vertex of a path.
struct Group {
  std::array<std::uint32_t, 4> bits;
  float u(int i) const { return unit_float(bits[static_cast<std::size_t>(i)]); }
};

class SampleStream {
 public:
  // The number of vertices of a path whose numbers are low-discrepancy points. Later vertices, which gain
  // nothing from such points, get hashed numbers.
  static constexpr int kSobolVertices = 6;

  SampleStream(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint64_t sample)
      : SampleStream(combine(combine(seed, (std::uint64_t{y} << 32) | x), sample & 1), sample >> 1) {}

  // For a path that splits in two: the first part continues with this stream, and this function returns the
  // stream of the second part.
  SampleStream of_branch() const {
    SampleStream s(*this);
    s.sequence_ = combine(sequence_, kBranch);
    s.sample_ = combine(sample_, kBranch);
    return s;
  }

  Group group(int vertex, Purpose purpose) const {
    if (static_cast<std::uint32_t>(vertex) < by_sobol_)
      return {sobol4_reversed(
          reversed_,
          combine_mixed(sequence_,
                        kMixedSlots.value[static_cast<std::size_t>(vertex)][static_cast<int>(purpose)]))};
    return hashed(slot(vertex, purpose));
  }
  // Returns a stream of unbounded length, for a tracker (an algorithm that steps through a medium from
  // collision to collision), which draws a random number of values.
  RandomStream stream(int vertex, Purpose purpose) const {
    return RandomStream(combine(sample_, slot(vertex, purpose)));
  }

 private:
  static constexpr std::uint64_t kBranch = 0x9e6c'63d0'876a'3f6b;
  static constexpr int kPurposes = static_cast<int>(Purpose::end);
  static constexpr std::uint64_t slot(int vertex, Purpose purpose) {
    return (static_cast<std::uint64_t>(vertex) << 8) | static_cast<std::uint32_t>(purpose);
  }
  struct MixedSlots {
    std::uint64_t value[kSobolVertices][kPurposes];
  };
  static constexpr MixedSlots mixed_slots() {
    MixedSlots m{};
    for (int v = 0; v < kSobolVertices; ++v)
      for (int p = 0; p < kPurposes; ++p) m.value[v][p] = mix64(slot(v, static_cast<Purpose>(p)));
    return m;
  }
  static const MixedSlots kMixedSlots;

  // `sequence` is the key of the half (A or B) of the pixel's samples, and `index` the index of the sample in
  // this half. A Sobol sequence of 32-bit points has 2^32 members; later samples get hashed numbers.
  SampleStream(std::uint64_t sequence, std::uint64_t index)
      : sequence_(sequence),
        sample_(combine(sequence, index)),
        reversed_(reverse_bits(static_cast<std::uint32_t>(index))),
        by_sobol_(index >> 32 == 0 ? kSobolVertices : 0) {}

  Group hashed(std::uint64_t slot) const {
    const std::uint64_t a = combine(sample_, slot), b = mix64(a + 0x9e3779b97f4a7c15ull);
    return {{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a >> 32),
             static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(b >> 32)}};
  }

  std::uint64_t sequence_;  // key of the Sobol points: the pixel, the half and the branch
  std::uint64_t sample_;    // key of the hashed numbers of this sample
  std::uint32_t reversed_;  // index of the sample within its half, bits reversed
  std::uint32_t by_sobol_;  // number of vertices whose numbers are Sobol points
};
inline constexpr SampleStream::MixedSlots SampleStream::kMixedSlots = SampleStream::mixed_slots();

}  // namespace ls::render
