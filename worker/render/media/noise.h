// Gradient noise in octaves, and bounds of it in boxes. Only integers and plain IEEE arithmetic are used, so
// the same place has the same noise on every machine.
//
// The noise is Perlin's (K. Perlin, Improving Noise, SIGGRAPH 2002), with gradients from a hash of the
// lattice point instead of a table: it does not repeat within 2^32 cells.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/scene/limits.h"
#include "core/scene/scene.h"
#include "worker/render/math/math.h"
#include "worker/render/math/value_bounds.h"

namespace ls::render {

// Perlin's weight: its first and second derivatives are 0 at both ends of [0, 1].
template <class T>
T perlin_weight(T t) {
  return t * t * t * (t * (6 * t - 15) + 10);
}

// Bounds of gradient noise with gradients such as (1, 1, 0), of its derivative along an axis, and of its
// second derivative along an axis. Noise is a mean, with Perlin's weights, of g . d over the corners of its
// cell, where d leads from the corner to the point. |g . d| is at most the sum of the two largest |d_k|, and
// the largest mean of these sums, in the middle of the cell, is about 1.037 (noise_test.cpp). Along x noise
// is (1 - w) a + w b with the weight w. a and b are means over two faces, whose distances are x and 1 - x,
// and the mean of |d_y| on a face is at most 1/2, as is that of |d_z|: |a| <= x + 1, |b| <= 2 - x, and |a'|,
// |b'| <= 1. So the derivative is at most 3 w' + 1, where w' = 30 x^2 (1 - x)^2, and the second derivative at
// most 3 |w''| + 4 w', where w'' = 60 x (1 - x) (1 - 2 x).
inline constexpr double kMostNoise = 1.06, kMostNoiseSlope = 6.625, kMostNoiseBend = 21.2;

// Returns the noise at p [cells], for one of 2^32 noises.
inline float gradient_noise(std::uint32_t seed, const V3d& p) {
  // Beyond this the parts within a cell are lost to rounding; this also refuses what is not a number.
  if (!(std::abs(p.x) + std::abs(p.y) + std::abs(p.z) < 0x1p50)) return 0;
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto x = static_cast<float>(p.x - fx), y = static_cast<float>(p.y - fy),
             z = static_cast<float>(p.z - fz);
  // Large odd numbers, so that the products of neighbouring coordinates differ in all bits
  constexpr std::uint32_t kX = 0x8da6b343, kY = 0xd8163841, kZ = 0xcb1ab31f;
  const auto lattice = [](double floor, std::uint32_t k) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(floor)) * k;
  };
  const std::uint32_t hx = lattice(fx, kX), hy = lattice(fy, kY), hz = lattice(fz, kZ);
  float corner[8];
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t a = i & 1, b = i >> 1 & 1, c = i >> 2;
    // The mixer is "lowbias32" of C. Wellons, hash-prospector (2018).
    std::uint32_t h = (hx + a * kX) ^ (hy + b * kY) ^ (hz + c * kZ) ^ seed;
    h = (h ^ h >> 16) * 0x7feb352d;
    h = (h ^ h >> 15) * 0x846ca68b;
    const std::uint32_t g = (h ^ h >> 16) >> 28;
    // Perlin's choice of a gradient by four bits
    const float dx = x - static_cast<float>(a), dy = y - static_cast<float>(b),
                dz = z - static_cast<float>(c);
    const float u = g < 8 ? dx : dy, v = g < 4 ? dy : (g & 13) == 12 ? dx : dz;
    corner[i] = ((g & 1) != 0 ? -u : u) + ((g & 2) != 0 ? -v : v);
  }
  const float wx = perlin_weight(x), wy = perlin_weight(y), wz = perlin_weight(z);
  float edge[4];
  for (int i = 0; i < 4; ++i) edge[i] = corner[2 * i] + wx * (corner[2 * i + 1] - corner[2 * i]);
  const float near = edge[0] + wy * (edge[1] - edge[0]), far = edge[2] + wy * (edge[3] - edge[2]);
  return near + wz * (far - near);
}

// One octave of a sum of noises.
struct Octave {
  double frequency = 1;  // cells of this octave along one cell of the first
  float strength = 1;
  V3d shift{0, 0, 0};  // keeps the octaves' lattices apart [cells of this octave]
  std::uint32_t seed = 0;
};

// Bounds the sum of octaves of a noise in the box [lo, hi], in cells of the first octave. at(octave, p)
// returns the noise of an octave at p, in cells of this octave. Where a box is small, noise is about linear
// between its corners: interpolation between them errs by at most h^2 / 8 times the second derivative along
// each axis.
template <class Octaves, class At>
ValueBounds bounds_of_octaves(const Octaves& octaves, const V3d& lo, const V3d& hi, const At& at) {
  std::array<double, 8> corner{};
  double slack = 0;
  for (const Octave& o : octaves) {
    const V3d h = (hi - lo) * o.frequency;
    const double bend = kMostNoiseBend / 8 * h.dot(h);
    // Where the bend is larger, the corners say nothing about the values between them; nor where rounding has
    // taken the lattice's place.
    const V3d p = lo * o.frequency, q = hi * o.frequency;
    const double far = std::max(p.dot(p), q.dot(q));
    if (!(bend < kMostNoise / 2) || !(far < 0x1p80)) {
      slack += o.strength * kMostNoise;
      continue;
    }
    slack += o.strength * bend;
    for (std::size_t i = 0; i < corner.size(); ++i) {
      const V3d p(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z);
      corner[i] += o.strength * at(o, p * o.frequency + o.shift);
    }
  }
  double least = corner[0], most = corner[0];
  for (const double c : corner) least = std::min(least, c), most = std::max(most, c);
  constexpr double kRounding = 1e-5;
  return {static_cast<float>(least - slack - kRounding), static_cast<float>(most + slack + kRounding)};
}

// The sum of the octaves of a noise volume, divided by the sum of their strengths and limited to [-1, 1].
class FractalNoise {
 public:
  explicit FractalNoise(const NoiseVolume& v);

  // At p, in cells of the first octave
  float value(const V3d& p) const {
    float sum = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Octave& o = octaves_[i];
      sum += o.strength * gradient_noise(o.seed, p * o.frequency + o.shift);
    }
    return std::min(1.f, std::max(-1.f, sum));
  }
  ValueBounds bounds(const V3d& lo, const V3d& hi) const;
  double finest() const { return 1 / octaves_[count_ - 1].frequency; }  // size of a cell of the last octave

 private:
  std::array<Octave, scene::kMaxNoiseOctaves> octaves_;
  std::size_t count_ = 0;
};

}  // namespace ls::render
