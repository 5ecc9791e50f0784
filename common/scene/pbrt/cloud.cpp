#include "common/scene/pbrt/cloud.h"

#include <algorithm>
#include <cmath>

namespace ls::scene::pbrt {
namespace {

// pbrt's constants. Each octave of noise has half the strength of the one before and this many times its
// frequency.
constexpr double kFiner = 1.99;
constexpr int kOctaves = 5;
// Number of times that a point is moved by the gradient of noise, and the frequency of the first such noise.
constexpr int kWarps = 2;
constexpr double kWarpFrequency = 10;

Vec3 plus(const Vec3& a, double x, const Vec3& b) {
  return Vec3{{a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]}};
}
Vec3 times(double x, const Vec3& a) { return Vec3{{x * a[0], x * a[1], x * a[2]}}; }

// Returns how many cells the finest noise has per unit of length. The finest noise is the last octave or, if
// noise also moves the points (wispiness > 0), the last noise that does so.
double cells_per_unit(const Cloud& cloud) {
  const double octaves = std::pow(kFiner, kOctaves - 1);
  return std::abs(cloud.frequency) *
         (cloud.wispiness > 0 ? std::max(octaves, kWarpFrequency * kFiner) : octaves);
}

// Least number of nodes per unit of height. They resolve the thinning of the density with height, which is
// piecewise linear with corners at 0, 1/2 and 1.
constexpr double kLeastPerHeight = 64;

// Returns the sides of a grid that samples the cloud's density with `per_cell` nodes along an axis per cell
// of the finest noise (in y also with at least kLeastPerHeight nodes per unit of length). nullopt: the grid
// would have more than `most` nodes.
std::optional<CloudNodes> nodes_of(const Cloud& cloud, double per_cell, std::size_t most) {
  CloudNodes out;
  out.per_cell = per_cell;
  double count = 1;
  std::array<double, 3> sides{};
  for (std::size_t i = 0; i < 3; ++i) {
    double per_unit = per_cell * cells_per_unit(cloud);
    if (i == 1) per_unit = std::max(per_unit, kLeastPerHeight);
    sides[i] = 1 + std::max(1., std::ceil((cloud.high[i] - cloud.low[i]) * per_unit));
    count *= sides[i];
  }
  if (!(count <= static_cast<double>(most))) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) out.sides[i] = static_cast<int>(sides[i]);
  return out;
}

}  // namespace

double density_at(const Cloud& cloud, const Vec3& p) {
  if (p[1] <= 0) return 1;  // the clamped sum below is 1 for any noise
  Vec3 q = times(cloud.frequency, p);
  if (cloud.wispiness > 0) {
    double strength = 0.05 * cloud.wispiness, frequency = kWarpFrequency;
    for (int i = 0; i < kWarps; ++i) {
      q = plus(q, strength, noise_slope(times(frequency, q)));
      strength /= 2;
      frequency *= kFiner;
    }
  }
  double sum = 0, strength = 0.5, frequency = 1;
  for (int i = 0; i < kOctaves; ++i) {
    sum += strength * noise(times(frequency, q));
    strength /= 2;
    frequency *= kFiner;
  }
  const double thinned = std::clamp((1 - p[1]) * 4.5 * cloud.density * sum, 0., 1.);
  return std::clamp(thinned + 2 * std::max(0., 0.5 - p[1]), 0., 1.);
}

std::optional<CloudNodes> nodes_for(const Cloud& cloud, std::size_t most) {
  if (auto wanted = nodes_of(cloud, kWantedPerCell, most)) return wanted;
  std::optional<CloudNodes> best = nodes_of(cloud, kLeastPerCell, most);
  if (!best) return std::nullopt;
  double low = kLeastPerCell, high = kWantedPerCell;
  for (int i = 0; i < 20; ++i) {
    const double middle = (low + high) / 2;
    if (auto some = nodes_of(cloud, middle, most)) {
      best = some;
      low = middle;
    } else {
      high = middle;
    }
  }
  return best;
}

MadeGrid cloud_grid(const Cloud& cloud, const CloudNodes& nodes) {
  MadeGrid grid{nodes.sides, 1, {}};
  grid.values.reserve(nodes.count());
  const auto place = [&](std::size_t axis, int i) {
    const double t = static_cast<double>(i) / (nodes.sides[axis] - 1);
    return cloud.low[axis] + t * (cloud.high[axis] - cloud.low[axis]);
  };
  for (int z = 0; z < nodes.sides[2]; ++z)
    for (int y = 0; y < nodes.sides[1]; ++y)
      for (int x = 0; x < nodes.sides[0]; ++x)
        grid.values.push_back(
            static_cast<float>(density_at(cloud, Vec3{{place(0, x), place(1, y), place(2, z)}})));
  return grid;
}

}  // namespace ls::scene::pbrt
