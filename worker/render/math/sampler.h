// The random numbers of one sample of a pixel. They are a pure function of (seed, pixel, sample index,
// branch, vertex, purpose), where a branch is one of the paths into which a path splits. Even sample indices
// form half A, odd ones half B; each half of each pixel is its own scrambled Sobol sequence.
#pragma once

#include <array>
#include <cstdint>

#include "worker/render/math/random.h"
#include "worker/render/math/sobol.h"

namespace ls::render {

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

  // Where a path splits in two, the first continues with this stream; returns the stream of the second.
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

  // `sequence` is the key of the half, `index` the index of the sample in it. A Sobol sequence of 32-bit
  // points has 2^32 members; later samples get hashed numbers.
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

  std::uint64_t sequence_;  // key of the half of the pixel
  std::uint64_t sample_;    // key of the sample
  std::uint32_t reversed_;  // index within the half, bits reversed
  std::uint32_t by_sobol_;  // number of vertices with Sobol points
};
inline constexpr SampleStream::MixedSlots SampleStream::kMixedSlots = SampleStream::mixed_slots();

}  // namespace ls::render
