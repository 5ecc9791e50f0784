// Pixels of the fake renderer: a pure function of the unit, for tests of everything around the renderer. A
// sample is hash(scene, settings, pixel, sample) / 256 with an integer numerator below 256 plus a gradient of
// the pixel, so that float sums of up to 2^15 samples are exact: sums over [a,b) and [b,c) of one half add up
// to those over [a,c), bit for bit, and a test may compare any two groupings.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

#include "common/image/id_slots.h"
#include "common/image/partial.h"

namespace ls {

inline std::uint64_t fake_mix(std::uint64_t x) {  // the finaliser of splitmix64
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// All that names a unit's pixels but its place: the first 8 bytes of both digests.
inline std::uint64_t fake_seed(const UnitHeader& header) {
  std::uint64_t scene = 0, settings = 0;
  std::memcpy(&scene, header.scene.bytes.data(), sizeof scene);
  std::memcpy(&settings, header.settings.bytes.data(), sizeof settings);
  return fake_mix(scene + 0x9e3779b97f4a7c15ull) ^ fake_mix(settings);
}

// One sample: R, G, B in [0, 2), multiples of 1/256.
inline std::array<float, 3> fake_sample(std::uint64_t seed, int x, int y, std::uint64_t sample) {
  const auto place =
      static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32 | static_cast<std::uint32_t>(x);
  const std::uint64_t h = fake_mix(fake_mix(seed ^ fake_mix(place)) + sample);
  std::array<float, 3> rgb{};
  for (int c = 0; c < 3; ++c) {
    const auto noise = static_cast<std::uint32_t>(h >> (8 * c)) & 255u;
    const std::uint32_t gradient = static_cast<std::uint32_t>(c == 0 ? x : c == 1 ? y : x + y) & 255u;
    rgb[static_cast<std::size_t>(c)] = static_cast<float>(noise + gradient) / 256.f;
  }
  return rgb;
}

// The AOVs of a pixel: sums of the samples' red, every sample a hit, of one thing.
inline void fake_aovs(Partial& partial, std::size_t pixel, std::size_t pixels) {
  const AovPlanes planes = planes_of(partial.aovs);
  const float red = partial.sums[pixel] + partial.sums[3 * pixels + pixel];
  const auto count = static_cast<float>(partial.header.samples.count());
  for (std::size_t p = 0; p < planes.sums.size(); ++p)
    partial.sums[(kPartialChannels + p) * pixels + pixel] = p == planes.hits ? count : red;
  for (std::size_t p = 0; p < planes.ids.size(); ++p)
    store_slots(ranked({{1.f, count}}),
                &partial.sums[(kPartialChannels + planes.sums.size() + p * kIdPlanes) * pixels + pixel],
                pixels);
}

inline Partial fake_partial(const UnitHeader& header, AovSet aovs = {}) {
  Partial partial{header, {}, aovs};
  const auto pixels = static_cast<std::size_t>(header.tile.pixels());
  partial.sums.assign(pixels * (kPartialChannels + planes_of(aovs).count()), 0.f);
  const std::uint64_t seed = fake_seed(header);
  std::size_t i = 0;
  for (int y = header.tile.y0; y < header.tile.y1; ++y)
    for (int x = header.tile.x0; x < header.tile.x1; ++x, ++i)
      for (std::uint64_t s = header.samples.s0; s < header.samples.s1; ++s) {
        const auto rgb = fake_sample(seed, x, y, s);
        for (std::size_t c = 0; c < 3; ++c) partial.sums[((s & 1) * 3 + c) * pixels + i] += rgb[c];
      }
  for (i = 0; i < pixels && !aovs.empty(); ++i) fake_aovs(partial, i, pixels);
  return partial;
}

}  // namespace ls
