#include "common/scene/pbrt/cloud.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace ls::scene::pbrt {
namespace {

constexpr int kPeriod = 256;

// The permutation of Perlin's paper.
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

// The gradients, indexed by a hash with 16 values: the 12 directions from the centre of a cube to the
// middles of its edges, four of which occur twice. This is pbrt's list. Perlin's has another order, and
// repeats (0, -1, 1) instead of (0, 1, -1).
constexpr std::array<std::array<std::int8_t, 3>, 16> kGradients{{{1, 1, 0},
                                                                 {-1, 1, 0},
                                                                 {1, -1, 0},
                                                                 {-1, -1, 0},
                                                                 {1, 0, 1},
                                                                 {-1, 0, 1},
                                                                 {1, 0, -1},
                                                                 {-1, 0, -1},
                                                                 {0, 1, 1},
                                                                 {0, -1, 1},
                                                                 {0, 1, -1},
                                                                 {0, -1, -1},
                                                                 {1, 1, 0},
                                                                 {-1, 1, 0},
                                                                 {0, 1, -1},
                                                                 {0, -1, -1}}};

std::size_t permuted(std::size_t i) { return kPermutation[i % kPeriod]; }

// Perlin's weight: its first and second derivatives are 0 at both ends of [0, 1].
double weight(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

double between(double t, double a, double b) { return a + t * (b - a); }

}  // namespace

double noise(const Vec3& p) {
  std::array<std::size_t, 3> cell{};
  std::array<double, 3> in{}, w{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(p[i])) return 0;
    const double floor = std::floor(p[i]), turn = std::fmod(floor, kPeriod);
    cell[i] = static_cast<std::size_t>(turn < 0 ? turn + kPeriod : turn);
    in[i] = p[i] - floor;
    w[i] = weight(in[i]);
  }
  const auto corner = [&](std::size_t x, std::size_t y, std::size_t z) {
    const auto& g =
        kGradients[permuted(permuted(permuted(cell[0] + x) + cell[1] + y) + cell[2] + z) % kGradients.size()];
    return g[0] * (in[0] - static_cast<double>(x)) + g[1] * (in[1] - static_cast<double>(y)) +
           g[2] * (in[2] - static_cast<double>(z));
  };
  const auto edge = [&](std::size_t y, std::size_t z) {
    return between(w[0], corner(0, y, z), corner(1, y, z));
  };
  return between(w[2], between(w[1], edge(0, 0), edge(1, 0)), between(w[1], edge(0, 1), edge(1, 1)));
}

Vec3 noise_slope(const Vec3& p) {
  constexpr double kStep = 0.01;
  const double here = noise(p);
  Vec3 slope;
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 q = p;
    q[i] += kStep;
    slope[i] = (noise(q) - here) / kStep;
  }
  return slope;
}

}  // namespace ls::scene::pbrt
