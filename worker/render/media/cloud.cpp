#include "worker/render/media/cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "worker/render/media/noise.h"

namespace ls::render {
namespace {

constexpr int kPeriod = 256;

// The permutation of Perlin's noise (see noise() in cloud.h).
constexpr std::array<std::uint8_t, kPeriod> kPermutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// The gradients, indexed by a hash with 16 values: the 12 directions from the centre of a cube to the middles
// of its edges, four of which occur twice. This is pbrt's list. Perlin's has another order, and repeats (0,
// -1, 1) instead of (0, 1, -1).
constexpr std::int8_t kGradients[16][3] = {
    {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
    {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, 1, -1}, {0, -1, -1}};

std::size_t permuted(std::size_t i) { return kPermutation[i % kPeriod]; }

double between(double t, double a, double b) { return a + t * (b - a); }

// Constants of pbrt's formula. Each octave of noise has half the strength and kFiner times the frequency of
// the octave before.
constexpr double kFiner = 1.99;
constexpr std::size_t kOctaves = 5;
// Number of times that a point is moved by the gradient of noise, the strength of the first move per
// wispiness, and the frequency of the first such noise.
constexpr int kWarps = 2;
constexpr double kWarpStrength = 0.05, kWarpFrequency = 10;

constexpr std::array<Octave, kOctaves> kSum = [] {
  std::array<Octave, kOctaves> octaves;
  float strength = 0.5;
  double frequency = 1;
  for (Octave& o : octaves) {
    o.strength = strength;
    o.frequency = frequency;
    strength /= 2;
    frequency *= kFiner;
  }
  return octaves;
}();

}  // namespace

double cloud_noise(const V3d& p) {
  std::array<std::size_t, 3> cell{};
  std::array<double, 3> in{}, w{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = p[static_cast<int>(i)];
    if (!(std::abs(x) < 0x1p50)) return 0;
    const double floor = std::floor(x);
    cell[i] = static_cast<std::size_t>(static_cast<std::int64_t>(floor) & (kPeriod - 1));
    in[i] = x - floor;
    w[i] = perlin_weight(in[i]);
  }
  const auto corner = [&](std::size_t x, std::size_t y, std::size_t z) {
    const auto& g = kGradients[permuted(permuted(permuted(cell[0] + x) + cell[1] + y) + cell[2] + z) %
                               std::size(kGradients)];
    return g[0] * (in[0] - static_cast<double>(x)) + g[1] * (in[1] - static_cast<double>(y)) +
           g[2] * (in[2] - static_cast<double>(z));
  };
  const auto edge = [&](std::size_t y, std::size_t z) {
    return between(w[0], corner(0, y, z), corner(1, y, z));
  };
  return between(w[2], between(w[1], edge(0, 0), edge(1, 0)), between(w[1], edge(0, 1), edge(1, 1)));
}

V3d cloud_noise_slope(const V3d& p) {
  constexpr double kStep = 0.01;
  const double here = cloud_noise(p);
  V3d slope;
  for (int i = 0; i < 3; ++i) {
    V3d q = p;
    q[i] += kStep;
    slope[i] = (cloud_noise(q) - here) / kStep;
  }
  return slope;
}

double Cloud::finest() const { return 1 / (std::abs(frequency_) * kSum.back().frequency); }

float Cloud::value(const V3d& p) const {
  if (p.y <= 0) return 1;  // for any noise the sum below is at least 1, and is limited to 1
  V3d q = p * frequency_;
  if (wispiness_ > 0) {
    double strength = kWarpStrength * wispiness_, frequency = kWarpFrequency;
    for (int i = 0; i < kWarps; ++i) {
      q = q + cloud_noise_slope(q * frequency) * strength;
      strength /= 2;
      frequency *= kFiner;
    }
  }
  double sum = 0;
  for (const Octave& o : kSum) sum += o.strength * cloud_noise(q * o.frequency);
  return static_cast<float>(std::clamp(noise_at(p.y, sum) + ground_at(p.y), 0., 1.));
}

// The two terms of the density: of the noise, and of the ground.
double Cloud::noise_at(double height, double sum) const {
  return std::clamp((1 - height) * 4.5 * density_ * sum, 0., 1.);
}
double Cloud::ground_at(double height) { return 2 * std::max(0., 0.5 - height); }

ValueBounds Cloud::bounds(const V3d& lo, const V3d& hi) const {
  // All moves together move a point by at most this, along each axis.
  const V3d moved(kWarpStrength * wispiness_ * (2 - std::exp2(1 - kWarps)) * kMostNoiseSlope);
  const V3d a = lo * frequency_, b = hi * frequency_;
  V3d from, to;
  for (int k = 0; k < 3; ++k) {
    from[k] = std::min(a[k], b[k]) - moved[k];
    to[k] = std::max(a[k], b[k]) + moved[k];
  }
  const ValueBounds sum =
      bounds_of_octaves(kSum, from, to, [](const Octave&, const V3d& p) { return cloud_noise(p); });
  // Between two heights and two sums the product of the first term is largest, and least, at one of the four.
  double least = 1, most = 0;
  for (const double height : {lo.y, hi.y})
    for (const float s : {sum.lo, sum.hi}) {
      const double noise = noise_at(height, s);
      least = std::min(least, noise);
      most = std::max(most, noise);
    }
  return {static_cast<float>(std::clamp(least + ground_at(hi.y), 0., 1.)),
          static_cast<float>(std::clamp(most + ground_at(lo.y), 0., 1.))};
}

}  // namespace ls::render
