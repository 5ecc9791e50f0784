// The exponential density sigma e^(-sigma x) truncated to [0, length]: by expm1 and log1p's kin throughout,
// so that it is as good for a depth of 1e-20, where it is uniform, as for 1e6 (the textbook 1 - exp returns 0
// in float32 for all depths below 6e-8).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "worker/render/hash.h"

namespace ls::render {

// Thinner than this a stretch's density is uniform to the last bit; products with it stay clear of underflow.
inline constexpr float kThinDepth = 1e-20f;

// sigma >= 0; length > 0, possibly infinite; x in [0, length]. 0 where sigma is 0 and length infinite: no
// such density exists.
inline float truncated_pdf(float sigma, float length, float x) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return 1 / length;
  return sigma * std::exp(-sigma * x) / -std::expm1(-depth);
}

// v: uniform in (0, 1). Not finite where there is no such density.
inline float truncated_sample(float sigma, float length, double v) {
  const float depth = sigma * length;
  if (!(depth > kThinDepth)) return static_cast<float>(v) * length;
  const double through = std::exp(-double{depth}), rest = -std::expm1(-double{depth});
  const float x = minus_log(static_cast<float>((1 - v) + v * through), static_cast<float>(v * rest));
  return std::min(x / sigma, length);
}

}  // namespace ls::render
