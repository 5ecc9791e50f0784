// Grids made by hand for the tests of grids and of the trackers on top of them.
#pragma once

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "worker/render/media/grid.h"

namespace ls::render {

using Size = std::array<int, 3>;
inline constexpr VolumeFilter kNearest = VolumeFilter::nearest, kTrilinear = VolumeFilter::trilinear;

// Nodes at integer points of the world; the domain may extend beyond them.
inline Grid unit_grid(Size n, std::vector<float> v, double beyond = 0, double sigma = 1) {
  return {n,
          std::move(v),
          Affine(),
          V3d(-beyond),
          V3d(n[0] - 1 + beyond, n[1] - 1 + beyond, n[2] - 1 + beyond),
          sigma};
}
// Voxels of width 1 with their centres at integer points, as in a .vol file.
inline Grid voxel_grid(Size n, std::vector<float> v, VolumeFilter filter, Wrap wrap, double sigma = 1) {
  return {n, std::move(v), Affine(), V3d(-.5), V3d(n[0] - .5, n[1] - .5, n[2] - .5), sigma, filter, wrap};
}
// The value at a point of the world, also outside of a grid that repeats.
inline float value_at(const Grid& g, const V3& p) { return g.value_anywhere(g.to_index(p)); }
inline std::vector<float> random_values(Size n, unsigned seed, bool sparse = false) {
  std::mt19937 rng(seed);
  std::vector<float> v(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  for (float& x : v) x = sparse && rng() % 8 ? 0.f : static_cast<float>(rng()) * 0x1p-32f;
  return v;
}
inline V3d random_direction(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const double x = n(rng), y = n(rng), z = n(rng);
  return V3d(x, y, z).normalized();
}

}  // namespace ls::render
