// The Henyey-Greenstein phase function. It is written in x, the distance between the cosine of the scattering
// angle and that at the function's peak: x = 1 - cos for g >= 0 and x = 1 + cos for g < 0. This form has no
// division by g and does not compute x from a rounded cosine, so it is exact for g = 0 and stable up to |g| =
// 0.99999. (Derivation: 1 - cos and 1 + cos of the sampled angle are rational functions of the random number
// xi.)
#pragma once

#include "worker/render/base/work_counters.h"
#include "worker/render/math/math.h"

namespace ls::render {

struct PhaseSample {
  V3 w;
  float pdf;  // density per steradian; sampling is exact, so it equals the phase function
};

struct HenyeyGreenstein {
  float g = 0;

  // Returns the phase function [1/sr] for the directions of travel w before and w1 after the scattering. It
  // integrates to 1 over w1.
  float value(const V3& w, const V3& w1) const {
    LS_COUNT(phase);
    const V3 diff = g >= 0 ? w - w1 : w + w1;  // |diff|^2 / 2 is x
    return from_x(.5f * dot(diff, diff));
  }
  PhaseSample sample(const V3& w, V2 u) const {
    LS_COUNT(phase);
    const float a = std::abs(g), xi = u.x;
    const float d = (1 - a) * (1 - xi) + (1 + a) * xi, inv2 = 1 / (d * d);
    const float x = 2 * sqr(1 - a) * (1 - xi) * (1 + a * xi) * inv2;
    const float sine =
        2 * (1 - a) * (1 + a) * std::sqrt(xi * (1 - xi) * (1 + a * xi) * ((1 - a) + a * xi)) * inv2;
    const float cosine = g >= 0 ? 1 - x : x - 1;
    const V2 c = unit_circle(u.y) * sine;
    const Frame frame(w);
    const V3 w1 = frame.to_world({c.x, c.y, cosine});
    return {normalize(w1), from_x(x)};
  }

 private:
  float from_x(float x) const {
    const float a = std::abs(g), s = sqr(1 - a) + 2 * a * x;
    return (1 - a) * (1 + a) * kInvFourPi / (s * std::sqrt(s));
  }
};

}  // namespace ls::render
