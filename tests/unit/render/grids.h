// Makes grids for the tests of grids and of the trackers in them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "worker/render/media/grid.h"

namespace ls::render {

using Size = std::array<int, 3>;
inline constexpr VolumeFilter kNearest = VolumeFilter::nearest, kTrilinear = VolumeFilter::trilinear;

// A grid with nodes at integer points of the world. Its domain extends by `beyond` past the outermost nodes.
inline Grid unit_grid(Size n, std::vector<float> v, double beyond = 0, double sigma = 1) {
  return {n,
          std::move(v),
          Affine(),
          V3d(-beyond),
          V3d(n[0] - 1 + beyond, n[1] - 1 + beyond, n[2] - 1 + beyond),
          sigma};
}
// A grid of voxels of width 1 with centres at integer points, like that of a .vol file.
inline Grid voxel_grid(Size n, std::vector<float> v, VolumeFilter filter, Wrap wrap, double sigma = 1) {
  return {n, std::move(v), Affine(), V3d(-.5), V3d(n[0] - .5, n[1] - .5, n[2] - .5), sigma, filter, wrap};
}
// Returns the value at a world point. (Index coordinates differ from it in repeated grids.)
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

// The part [t0, t1] of an interval of a ray that is inside a box; empty if t0 > t1. If the ray is parallel to
// a face, the part is empty if the ray is outside of that face; otherwise the face does not limit it.
struct Interval {
  double t0, t1;
};
inline Interval clip(const V3d& lo, const V3d& hi, const V3d& o, const V3d& d, double t0, double t1) {
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (o[k] < lo[k] || o[k] > hi[k]) return {1, 0};
      continue;
    }
    double a = (lo[k] - o[k]) / d[k], b = (hi[k] - o[k]) / d[k];
    if (a > b) std::swap(a, b);
    t0 = std::max(t0, a);
    t1 = std::min(t1, b);
  }
  return {t0, t1};
}

// Returns the integral of the field along o + t d, t in [t0, t1]. It is exact up to rounding: within a voxel
// the field is a cubic in t, or constant, and two-point Gauss-Legendre integrates cubics exactly. Since it
// has no variance, it is the reference for the trackers.
inline double exact_integral(const Grid& g, const V3d& o, const V3d& d, double t0, double t1) {
  const V3d oi = g.exact_.point(o), di = g.exact_.vector(d);
  const Interval part = clip(V3d(g.lo_), V3d(g.hi_), oi, di, t0, t1);
  if (!(part.t0 < part.t1)) return 0;
  // `cuts` contains all crossings of the planes that separate the field's polynomial pieces, in order.
  // Between two successive cuts the field is one polynomial.
  const double offset = g.lookup_ == Lookup::trilinear ? 0 : .5;
  std::vector<double> cuts{part.t0, part.t1};
  for (int k = 0; k < 3; ++k) {
    if (di[k] == 0) continue;
    for (int i = 0; i < g.voxels_.size()[k]; ++i) {
      const double t = (i + offset - oi[k]) / di[k];
      if (t > part.t0 && t < part.t1) cuts.push_back(t);
    }
  }
  std::sort(cuts.begin(), cuts.end());
  const auto at = [&](double t) {
    const V3d q = oi + di * t;
    if (g.lookup_ == Lookup::nearest) return static_cast<double>(g.nearest(V3(q)));
    double v = 0;
    int c[3];
    double f[3];
    for (int k = 0; k < 3; ++k) {
      const double x = std::clamp(q[k], 0., static_cast<double>(g.voxels_.size()[k] - 1));
      c[k] = std::min(static_cast<int>(x), g.last_[k]);
      f[k] = x - c[k];
    }
    for (int corner = 0; corner < 8; ++corner) {
      const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
      const double w = (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
      const auto next = [&](int axis, int by) { return c[axis] + (g.voxels_.size()[axis] > 1 ? by : 0); };
      v += w * g.voxels_.at(next(0, i), next(1, j), next(2, k));
    }
    return v;
  };
  double sum = 0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double h = cuts[i + 1] - cuts[i], m = (cuts[i] + cuts[i + 1]) / 2, e = h / (2 * std::sqrt(3.));
    sum += h / 2 * (at(m - e) + at(m + e));
  }
  return sum;
}

}  // namespace ls::render
