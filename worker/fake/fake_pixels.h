// Pixels of the fake renderer, for tests of everything around the renderer. They are a pure function of the
// unit (one tile and one round, that is, one range of samples). A sample is 21 bits of noise in [0, 1) plus a
// gradient over the pixels. As in the renderer, the samples of a unit are summed in double and rounded to
// float once, so the resulting floats have full mantissas.
//
// Such sums cannot detect the order in which rounds are folded (added to the image): double sums of a few
// floats of similar size are exact, hence equal in every order. Therefore one pixel in kFakeMarkerEvery is a
// *marker*. Its samples are in [2^-47, 2^-46). In every group of kFakeMarkerRounds rounds, one round also
// adds a value in [1/2, 1), and a later round subtracts it again. While that value is in the sum, the sum
// keeps no bit below 2^-53, so each addition is rounded, and the last bits of the finished pixel depend on
// which rounds were folded before, between and after the two. One change of order goes undetected: the first
// two rounds of a tile may be swapped, since a + b is b + a. If a job ends within a group, only markers
// whose two rounds are both folded can detect the order.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "core/image/aov/identifiers.h"
#include "core/image/film/partial.h"

namespace ls {

inline std::uint64_t fake_mix(std::uint64_t x) {  // the finaliser of splitmix64
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// Returns the seed from which the seeds of all pixels of a job are computed. It is computed from the first 8
// bytes of the digest of the scene and of the digest of the settings.
inline std::uint64_t fake_seed(const UnitHeader& header) {
  std::uint64_t scene = 0, settings = 0;
  std::memcpy(&scene, header.scene.bytes.data(), sizeof scene);
  std::memcpy(&settings, header.settings.bytes.data(), sizeof settings);
  return fake_mix(scene + 0x9e3779b97f4a7c15ull) ^ fake_mix(settings);
}

inline constexpr std::uint64_t kFakeMarkerEvery = 32;  // one in this many pixels is a marker
inline constexpr RoundIndex kFakeMarkerRounds = 8;

// Returns the seed of the samples of the pixel (x, y); `seed` is fake_seed() of the unit.
inline std::uint64_t fake_pixel_seed(std::uint64_t seed, int x, int y) {
  const auto place =
      static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32 | static_cast<std::uint32_t>(x);
  return fake_mix(seed ^ fake_mix(place));
}
inline bool fake_is_marker(std::uint64_t pixel_seed) { return pixel_seed % kFakeMarkerEvery == 0; }

// Returns one sample: R, G, B in [0, 2), multiples of 2^-21; for a marker in [2^-47, 2^-46).
inline std::array<double, 3> fake_sample(std::uint64_t pixel_seed, int x, int y, std::uint64_t sample) {
  const std::uint64_t h = fake_mix(pixel_seed + sample);
  const bool marker = fake_is_marker(pixel_seed);
  std::array<double, 3> rgb{};
  for (int c = 0; c < 3; ++c) {
    const auto noise = static_cast<double>((h >> (21 * c)) & 0x1fffff);
    const auto gradient = static_cast<double>((c == 0 ? x : c == 1 ? y : x + y) & 255);
    rgb[static_cast<std::size_t>(c)] =
        marker ? (noise + 0x1p21) * 0x1p-68 : noise * 0x1p-21 + gradient * 0x1p-8;
  }
  return rgb;
}

// Returns the round that contains a sample; core/image/frame/rounds.h defines the rounds.
inline RoundIndex fake_round(std::uint64_t sample) {
  if (sample < 2) return 0;
  if (sample < 64) return static_cast<RoundIndex>(std::bit_width(sample) - 1);
  return static_cast<RoundIndex>(sample / 64 + 5);
}

// Returns the value that a marker adds in this round to both of its sums (of the even and of the odd
// samples), besides the samples: a value with a full mantissa, its negative, or 0.
inline double fake_mark(std::uint64_t pixel_seed, std::size_t channel, RoundIndex round) {
  const std::uint64_t h = fake_mix(~pixel_seed + 3 * (round / kFakeMarkerRounds) + channel);
  const auto one = static_cast<RoundIndex>(h % kFakeMarkerRounds);
  const auto other =
      static_cast<RoundIndex>((one + 1 + (h >> 8) % (kFakeMarkerRounds - 1)) % kFakeMarkerRounds);
  const RoundIndex at = round % kFakeMarkerRounds;
  if (at != one && at != other) return 0;
  const double value = static_cast<double>(h >> 40 | 0x800001) * 0x1p-24;
  return at == std::min(one, other) ? value : -value;
}

// Sets the AOVs of a pixel as if every sample hit the same object: each sum is the sum of the samples' red.
inline void fake_aovs(Partial& partial, std::size_t pixel, std::size_t pixels) {
  const AovPlanes planes = planes_of(partial.aovs);
  const float red = partial.sums[pixel] + partial.sums[3 * pixels + pixel];
  const auto count = static_cast<float>(partial.header.samples.count());
  for (std::size_t p = 0; p < planes.sums.size(); ++p)
    partial.sums[(kPartialChannels + p) * pixels + pixel] = p == planes.hits ? count : red;
  for (std::size_t p = 0; p < planes.ids.size(); ++p)
    store_slots(ranked({{1.f, count}}),
                &partial.sums[(kPartialChannels + planes.all_sums() + p * kIdPlanes) * pixels + pixel],
                pixels);
}

inline Partial fake_partial(const UnitHeader& header, AovSet aovs = {}) {
  Partial partial{header, {}, aovs};
  const auto pixels = static_cast<std::size_t>(header.tile.pixels());
  partial.sums.assign(pixels * (kPartialChannels + planes_of(aovs).count()), 0.f);
  const std::uint64_t seed = fake_seed(header);
  const RoundIndex round = fake_round(header.samples.s0);
  std::size_t i = 0;
  for (int y = header.tile.y0; y < header.tile.y1; ++y)
    for (int x = header.tile.x0; x < header.tile.x1; ++x, ++i) {
      const std::uint64_t pixel_seed = fake_pixel_seed(seed, x, y);
      std::array<double, kPartialChannels> sums{};
      if (fake_is_marker(pixel_seed))
        for (std::size_t c = 0; c < 3; ++c) sums[c] = sums[3 + c] = fake_mark(pixel_seed, c, round);
      for (std::uint64_t s = header.samples.s0; s < header.samples.s1; ++s) {
        const auto rgb = fake_sample(pixel_seed, x, y, s);
        for (std::size_t c = 0; c < 3; ++c) sums[(s & 1) * 3 + c] += rgb[c];
      }
      for (std::size_t c = 0; c < kPartialChannels; ++c)
        partial.sums[c * pixels + i] = static_cast<float>(sums[c]);
    }
  for (i = 0; i < pixels && !aovs.empty(); ++i) fake_aovs(partial, i, pixels);
  return partial;
}

}  // namespace ls
