// The numbers of one sample: f(seed, pixel, sample index, vertex, purpose), nothing else (DESIGN: law of
// determinism). Even sample indices are half A, odd ones half B; each half of each pixel is its own scrambled
// Sobol sequence.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/hash.h"
#include "worker/render/sobol.h"

namespace ls::render {

// What a group of numbers is for. A new purpose gets a new value; the order is part of the image's bits.
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
  veil,
  emission,
  distance,
  track_distance,
  overlap,
  overlap_emission,
  albedo
};

// Four numbers of one purpose at one path vertex.
struct Group {
  std::array<std::uint32_t, 4> bits;
  float u(int i) const { return unit_float(bits[static_cast<std::size_t>(i)]); }
};

class SampleStream {
 public:
  // Low-discrepancy points for this many vertices, hashed numbers beyond: later vertices gain nothing from
  // them.
  static constexpr int kSobolVertices = 6;

  SampleStream(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint64_t sample)
      : index_(sample >> 1),
        sequence_(combine(combine(seed, (std::uint64_t{y} << 32) | x), sample & 1)),
        sample_(combine(sequence_, index_)),
        reversed_(reverse_bits(static_cast<std::uint32_t>(index_))) {}

  Group group(int vertex, Purpose purpose) const {
    const auto slot = (static_cast<std::uint64_t>(vertex) << 8) | static_cast<std::uint32_t>(purpose);
    // A Sobol sequence of 32-bit points has 2^32 members; samples beyond are drawn by hash.
    if (vertex < kSobolVertices && index_ >> 32 == 0) {
      return {sobol4_reversed(reversed_, combine(sequence_, slot))};
    }
    const std::uint64_t a = combine(sample_, slot), b = mix64(a + 0x9e3779b97f4a7c15ull);
    return {{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a >> 32),
             static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(b >> 32)}};
  }
  // As many numbers as a tracker wants.
  RandomStream stream(int vertex, Purpose purpose) const {
    return RandomStream(
        combine(sample_, (static_cast<std::uint64_t>(vertex) << 8) | static_cast<std::uint32_t>(purpose)));
  }

 private:
  std::uint64_t index_;     // within the half
  std::uint64_t sequence_;  // names the half of the pixel
  std::uint64_t sample_;    // names the sample
  std::uint32_t reversed_;  // the index, its bits reversed
};

}  // namespace ls::render
