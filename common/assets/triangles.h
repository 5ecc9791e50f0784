// Polygon handling shared by the mesh readers.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "common/assets/data.h"

namespace ls {

inline bool is_drawable(const MeshData& m, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  double p[3][3];
  const std::uint32_t corner[] = {a, b, c};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      p[i][k] = m.positions[std::size_t{corner[i]} * 3 + k];
      if (!std::isfinite(p[i][k])) return false;
    }
  double area2 = 0;
  // In double, products of differences of floats cannot underflow.
  for (int k = 0; k < 3; ++k) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    const double n = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
    area2 += n * n;
  }
  return area2 > 0;
}

// Adds a polygon to `m` as a fan of triangles, from the corners (0, i, i + 1). Triangles without area or with
// a non-finite vertex are left out and counted in m.dropped_triangles. The indices in `corners` must be in
// range.
inline void add_polygon(MeshData& m, std::span<const std::uint32_t> corners) {
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    if (is_drawable(m, corners[0], corners[i], corners[i + 1]))
      m.indices.insert(m.indices.end(), {corners[0], corners[i], corners[i + 1]});
    else
      ++m.dropped_triangles;
  }
}

}  // namespace ls
