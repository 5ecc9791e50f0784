#include "worker/render/media/noise.h"

#include <algorithm>
#include <span>

#include "worker/render/math/random.h"

namespace ls::render {

FractalNoise::FractalNoise(const NoiseVolume& v) : count_(static_cast<std::size_t>(v.octaves)) {
  double strength = 1, sum = 0, frequency = 1;
  for (std::size_t i = 0; i < count_; ++i) {
    // Octaves of strength 0 cost as much as others.
    if (i > 0 && !(strength > 0)) {
      count_ = i;
      break;
    }
    sum += strength;
    strength *= v.gain;
  }
  strength = 1;
  for (std::size_t i = 0; i < count_; ++i) {
    Octave& o = octaves_[i];
    RandomStream dice(combine(v.seed, i));
    o.seed = dice.bits();
    if (i > 0)
      for (int k = 0; k < 3; ++k) o.shift[k] = dice.bits() * 0x1p-32;
    o.frequency = frequency;
    o.strength = static_cast<float>(strength / sum);
    strength *= v.gain;
    frequency *= v.lacunarity;
  }
}

ValueBounds FractalNoise::bounds(const V3d& lo, const V3d& hi) const {
  const ValueBounds sum =
      bounds_of_octaves(std::span(octaves_.data(), count_), lo, hi,
                        [](const Octave& o, const V3d& p) { return double{gradient_noise(o.seed, p)}; });
  return {std::clamp(sum.lo, -1.f, 1.f), std::clamp(sum.hi, -1.f, 1.f)};
}

}  // namespace ls::render
