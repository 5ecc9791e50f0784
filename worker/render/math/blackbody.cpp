#include "worker/render/math/blackbody.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/spectrum.h"

namespace ls::render {
namespace {

// The nodes of the table are evenly spaced in log T, where T is the temperature. The second derivative, by
// log T, of the logarithm of black-body radiation is at most c2 / (lambda T), with c2 the second radiation
// constant: 200 at 360 nm and 200 K. So linear interpolation between nodes that are `step` apart is off by
// 200 step^2 / 8 = 1e-4 and, from 500 K, by less than 4e-5.
constexpr int kNodes = 4096;
constexpr double kHottest = 1e6;

struct Table {
  std::array<std::array<float, 3>, kNodes> log_xyz;
  Table() {
    for (int i = 0; i < kNodes; ++i) {
      const double t = kColdest * std::pow(kHottest / kColdest, static_cast<double>(i) / (kNodes - 1));
      const auto xyz = scene::black_body_xyz(t);
      for (std::size_t c = 0; c < 3; ++c)
        log_xyz[static_cast<std::size_t>(i)][c] = static_cast<float>(std::log(xyz[c]));
    }
  }
};

}  // namespace

C3 black_body_radiance(float kelvin) {
  static const Table table;
  static const double per_log = (kNodes - 1) / std::log(kHottest / kColdest);
  if (!(kelvin >= kColdest)) return {0, 0, 0};
  const double t = std::min<double>(kelvin, kHottest);
  const double x = std::log(t / kColdest) * per_log;
  const auto i = static_cast<std::size_t>(std::min(x, kNodes - 2.));
  const double f = x - static_cast<double>(i);
  std::array<double, 3> xyz{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double log = table.log_xyz[i][c] + f * (table.log_xyz[i + 1][c] - table.log_xyz[i][c]);
    xyz[c] = std::exp(log) * (kelvin / t);
  }
  const Rgb rgb = scene::linear_srgb(xyz);
  C3 out;
  for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(std::max(0., rgb[static_cast<std::size_t>(c)]));
  return out;
}

C3 black_body_of_peak_one(float kelvin) {
  if (!(kelvin >= kColdest)) return {0, 0, 0};
  // Computed in double: the radiance is at least 1e-30 and the peak at most 4e-15 kelvin^5, far from the ends
  // of double's range, but their quotient may be close to the ends of float's.
  const double per_peak = 1 / scene::black_body_peak(kelvin);
  const C3 whole = black_body_radiance(kelvin);
  C3 out;
  for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(whole[c] * per_peak);
  return out;
}

}  // namespace ls::render
