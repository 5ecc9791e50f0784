// The exponential density sigma e^(-sigma x) truncated to [0, length], written with expm1 and log1p so that
// it is accurate for optical depths sigma * length from 1e-20, where it is uniform, to 1e6. The textbook form
// divides by 1 - exp(-sigma length), which is 0 in float32 for all depths below 6e-8.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "worker/render/math/random.h"

namespace ls::render {

// Below this optical depth the density is uniform to the last bit. The value is large enough that products
// with it do not underflow.
inline constexpr float kThinDepth = 1e-20f;

// The density at x. Requires sigma >= 0, length > 0 (may be infinite) and x in [0, length]. Returns 0 if
// sigma is 0 and length infinite: then there is no density.
inline float truncated_pdf(float sigma, float length, float x) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return 1 / length;
  return sigma * std::exp(-sigma * x) / -std::expm1(-depth);
}

// Samples x with the density truncated_pdf() from v, a uniform random number in (0, 1). The result is not
// finite if no such density exists.
inline float truncated_sample(float sigma, float length, double v) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return static_cast<float>(v) * length;
  const double through = std::exp(-double{depth}), rest = -std::expm1(-double{depth});
  const float x = minus_log(static_cast<float>((1 - v) + v * through), static_cast<float>(v * rest));
  return std::min(x / sigma, length);
}

// The truncated exponential mixed with a uniform density. It is used for grids, where the mean density of the
// cells may be far above the density along the ray. kEvenShare is the probability of the uniform part, in
// units of 2^-32.
inline constexpr std::uint32_t kEvenShare = 429496730;  // a tenth

inline float mixed_depth_pdf(float sigma, float length, float x) {
  constexpr float kEven = static_cast<float>(kEvenShare) * 0x1p-32f;
  return (1 - kEven) * truncated_pdf(sigma, length, x) + kEven / length;
}
inline float mixed_depth_sample(float sigma, float length, std::uint32_t bits) {
  if (bits < kEvenShare) return static_cast<float>((bits + .5) / kEvenShare * length);
  return truncated_sample(sigma, length, (bits - kEvenShare + .5) / (0x1p32 - kEvenShare));
}

}  // namespace ls::render
