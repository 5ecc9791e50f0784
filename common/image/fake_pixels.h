// The fake renderer's pixels: sums that are a pure function of (seed, pixel, sample, channel) by integer
// arithmetic, so that they are the same on every machine. Noise around a smooth picture: errors, folding and
// stopping behave as with a real one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/image/frame.h"
#include "common/image/partial.h"
#include "common/image/rounds.h"

namespace ls {

// splitmix64's finaliser (Steele, Lea, Flood 2014): a bijection of 64-bit integers that mixes well.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// One sample: uniform in [0, 2 m), a multiple of 2^-24, so that float and double hold it exactly. m is the
// pixel's mean, 1/4 to 1.
constexpr double fake_sample(std::uint64_t seed, int x, int y, std::uint64_t sample, int channel) {
  const std::uint64_t pixel =
      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32) | static_cast<std::uint32_t>(x);
  const std::uint64_t h =
      mix64(mix64(mix64(seed) ^ pixel) ^ (sample * 4 + static_cast<std::uint64_t>(channel)));
  const std::uint64_t wave = static_cast<std::uint64_t>((x * 3 + y * 5 + channel * 64) & 255);
  const std::uint64_t twice_mean = 128 + (wave < 128 ? wave : 255 - wave) * 3;  // in 1/256
  return static_cast<double>((h >> 40) * twice_mean >> 8) * 0x1p-24;
}

// The six planes of a Partial.
inline std::vector<float> fake_sums(std::uint64_t seed, PixelRect rect, SampleRange samples) {
  const auto plane = static_cast<std::size_t>(rect.pixels());
  std::vector<float> sums(plane * kPartialChannels);
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++i)
      for (int half = 0; half < 2; ++half)
        for (int channel = 0; channel < 3; ++channel) {
          double sum = 0;
          for (std::uint64_t s = samples.s0 + static_cast<std::uint64_t>(half); s < samples.s1; s += 2)
            sum += fake_sample(seed, x, y, s, channel);
          sums[static_cast<std::size_t>(half * 3 + channel) * plane + i] = static_cast<float>(sum);
        }
  return sums;
}

}  // namespace ls
