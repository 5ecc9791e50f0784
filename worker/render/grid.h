// A dense scalar grid, interpolated or not, and macro cells that bound it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/scene/scene.h"
#include "worker/render/math.h"
#include "worker/render/transform.h"

namespace ls::render {

// Density bounds over the cell, inflated so that interpolation in float32 stays inside; control for ratio
// tracking.
struct MacroCell {
  float hi = 0;        // >= any interpolated value
  float control = 0;   // near the mean
  float residual = 0;  // >= |value - control|
};

class Grid {
 public:
  Grid() = default;
  // Values at integer index coordinates, x fastest. `world_to_index` maps world points to them. The grid
  // exists inside [domain_lo, domain_hi] (index coordinates, which may reach beyond the outermost nodes:
  // there values are clamped) and is 0 outside. `density_to_sigma`: the largest extinction per unit of value
  // (world units); it steers the size of macro cells. `wrap` says what continues the nodes beyond their ends;
  // but for `clamp` the domain must be that of cell centres, [-1/2, n - 1/2].
  Grid(std::array<int, 3> size, std::vector<float> values, const Affine& world_to_index, V3d domain_lo,
       V3d domain_hi, double density_to_sigma, VolumeFilter filter = VolumeFilter::trilinear,
       Wrap wrap = Wrap::clamp);

  V3 to_index(const V3& p) const { return linear(p) + b_; }
  V3 linear(const V3& v) const {
    return {a_[0] * v.x + a_[1] * v.y + a_[2] * v.z, a_[3] * v.x + a_[4] * v.y + a_[5] * v.z,
            a_[6] * v.x + a_[7] * v.y + a_[8] * v.z};
  }
  VolumeFilter filter() const { return filter_; }
  // Value at index coordinates inside the domain. The filter is the caller's choice, once for many values; it
  // must be filter().
  template <VolumeFilter kFilter>
  float value(const V3& index) const {
    if constexpr (kFilter == VolumeFilter::trilinear) return trilinear(index);
    return nearest(index);
  }
  // Value at any index coordinates, whatever the filter: beyond the domain the grid goes on as `wrap` says.
  float value_anywhere(const V3& index) const {
    const V3 q = wrap_ == Wrap::clamp ? index : wrapped(index);
    return filter_ == VolumeFilter::trilinear ? trilinear(q) : nearest(q);
  }
  float trilinear(const V3& index) const {
    int cell[3];
    float f[3];
    const float q[3] = {index.x, index.y, index.z};
    for (int k = 0; k < 3; ++k) {
      const float c = std::min(std::max(q[k], 0.f), top_[k]);
      cell[k] = std::min(static_cast<int>(c), last_[k]);
      f[k] = c - static_cast<float>(cell[k]);
    }
    const float* v =
        values_.data() + (static_cast<std::size_t>(cell[2]) * size_[1] + cell[1]) * size_[0] + cell[0];
    const std::size_t dx = step_[0], dy = step_[1], dz = step_[2];
    const float c00 = v[0] + f[0] * (v[dx] - v[0]), c10 = v[dy] + f[0] * (v[dy + dx] - v[dy]);
    const float c01 = v[dz] + f[0] * (v[dz + dx] - v[dz]),
                c11 = v[dz + dy] + f[0] * (v[dz + dy + dx] - v[dz + dy]);
    const float c0 = c00 + f[1] * (c10 - c00), c1 = c01 + f[1] * (c11 - c01);
    return std::max(0.f, c0 + f[2] * (c1 - c0));
  }
  // Of the node whose cell the point is in; between two cells that of the larger number.
  float nearest(const V3& index) const {
    std::size_t i[3];
    const float q[3] = {index.x, index.y, index.z};
    for (int k = 0; k < 3; ++k) i[k] = static_cast<std::size_t>(std::min(std::max(q[k], 0.f), top_[k]) + .5f);
    return values_[(i[2] * size_[1] + i[1]) * size_[0] + i[0]];
  }

  int cell_size() const { return cell_size_; }
  std::array<int, 3> cells() const { return cells_; }
  const MacroCell& cell(int x, int y, int z) const {
    return macro_[(static_cast<std::size_t>(z) * cells_[1] + y) * cells_[0] + x];
  }
  V3 domain_lo() const { return lo_; }
  V3 domain_hi() const { return hi_; }
  float max_value() const { return max_value_; }
  std::uint64_t bytes() const { return values_.size() * sizeof(float) + macro_.size() * sizeof(MacroCell); }

  // Values above `limit`, each counted once.
  std::uint64_t count_above(float limit) const;

  // Integral of the field along o + t d, t in [t0, t1]: exact up to rounding (within a voxel the field is a
  // cubic in t, or constant, and two-point Gauss-Legendre integrates cubics exactly). Zero variance; the
  // truth for tests of the trackers.
  double exact_integral(const V3d& o, const V3d& d, double t0, double t1) const;

 private:
  void repeat_ends();
  V3 wrapped(const V3& index) const;
  void build_macro_cells(double density_to_sigma);
  MacroCell bound_cell(int x, int y, int z) const;

  std::array<int, 3> size_{}, last_{};
  std::array<float, 3> top_{};
  std::array<std::size_t, 3> step_{};
  std::vector<float> values_;
  float a_[9] = {};
  V3 b_, lo_, hi_;
  Affine exact_;  // world to index, unrounded
  VolumeFilter filter_ = VolumeFilter::trilinear;
  Wrap wrap_ = Wrap::clamp;
  bool padded_ = false;  // a layer of nodes from the opposite end lies around the given ones
  float max_value_ = 0;
  int cell_size_ = 8;
  std::array<int, 3> cells_{};
  std::vector<MacroCell> macro_;
};

// Walks the macro cells along a ray: for (CellWalk w(grid, o, d, t0, t1); w.next();) use w.cell(),
// [w.begin(), w.end()]. Boundaries are computed from integer cell numbers, never by adding steps up, and
// intervals never run backwards.
class CellWalk {
 public:
  CellWalk(const Grid& grid, const V3& o, const V3& d, float t0, float t1);
  bool next();
  const MacroCell& cell() const { return grid_.cell(at_[0], at_[1], at_[2]); }
  float begin() const { return begin_; }
  float end() const { return end_; }
  // Index coordinates of the point at t.
  V3 index(float t) const { return origin_ + direction_ * t; }

 private:
  float boundary(int axis) const {
    const int i = at_[axis] + (step_[axis] > 0 ? 1 : 0);
    return (lo_[axis] + static_cast<float>(i) * size_ - origin_[axis]) * inverse_[axis];
  }

  const Grid& grid_;
  V3 origin_, direction_, inverse_, lo_;
  float size_;
  int at_[3] = {}, step_[3] = {}, count_[3] = {};
  float exit_[3] = {};
  float begin_ = 0, end_ = 0, stop_ = 0;
  bool started_ = false;
};

}  // namespace ls::render
