// A grid of scalar values (voxels.h), with trilinear interpolation or without interpolation, or a field that
// is computed at each lookup (field.h). Its macro cells, which are blocks of voxels, store bounds of its
// values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/scene/scene.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/math/math.h"
#include "worker/render/math/transform.h"
#include "worker/render/math/value_bounds.h"
#include "worker/render/media/voxels.h"

namespace ls::render {

class Field;

// How a grid finds a value: by interpolation, from the nearest node, or by computing a field.
enum class Lookup : std::uint8_t { trilinear, nearest, field };

// The stored data of one macro cell: bounds of the density in it, inflated so that values interpolated in
// float32 stay within them, and the control value for ratio tracking.
struct MacroCell {
  float hi = 0;        // upper bound of all interpolated values
  float control = 0;   // control value for ratio tracking, near the mean of the values
  float residual = 0;  // upper bound of |value - control|
};

// The result of integrating the field along an interval of a ray. Integration stops at t: where the integral
// reaches a wanted value (`reached` is then true), else at the end of the interval.
struct Passage {
  bool reached = false;
  float t = 0;
  double integral = 0;
};

class Grid {
 public:
  Grid() = default;
  // `values` are the values at the nodes, which are the integer index coordinates, x fastest.
  // `world_to_index` maps world points to index coordinates. The grid is 0 outside of [domain_lo, domain_hi]
  // (index coordinates; the domain may extend beyond the outermost nodes, where values are clamped).
  // `density_to_sigma` is the largest extinction per unit of value, in world units; it determines the size of
  // macro cells. `wrap` determines how the nodes continue beyond the ends. Unless it is `clamp`, values must
  // be at cell centres: n nodes then have the domain [-1/2, n - 1/2].
  Grid(std::array<int, 3> size, std::vector<float> values, const Affine& world_to_index, V3d domain_lo,
       V3d domain_hi, double density_to_sigma, VolumeFilter filter = VolumeFilter::trilinear,
       Wrap wrap = Wrap::clamp);
  // The same for values that are stored already; they are not repeated.
  Grid(Voxels voxels, const Affine& world_to_index, V3d domain_lo, V3d domain_hi, double density_to_sigma,
       VolumeFilter filter = VolumeFilter::trilinear, Wrap wrap = Wrap::clamp);
  // A grid with a field in place of values, whose index coordinates are those of the field. `cell_size` is
  // the width of the macro cells [voxels, a power of two]. The field must outlive the grid.
  Grid(const Field& field, const Affine& world_to_index, V3d domain_lo, V3d domain_hi, int cell_size);
  // The number of boxes, along each axis, in which a field is bounded for one macro cell.
  static constexpr int kBoxesPerSide = 4;

  // Returns the index coordinates of the world point p. They are computed in double: if the grid is small in
  // its world, the terms are large and nearly cancel.
  V3 to_index(const V3& p) const { return V3(exact_.point(V3d(p))); }
  const Affine& world_to_index() const { return exact_; }
  Lookup lookup() const { return lookup_; }
  // Returns the value at index coordinates inside the domain. kLookup must equal lookup(). It is a template
  // parameter so that a caller that needs many values tests lookup() only once.
  template <Lookup kLookup>
  float value(const V3& index) const {
    LS_COUNT(density);
    if constexpr (kLookup == Lookup::trilinear) return trilinear(index);
    if constexpr (kLookup == Lookup::field) return computed(index);
    return nearest(index);
  }
  // Returns the value at any index coordinates, with the grid's own filter. Beyond the domain the grid
  // continues according to `wrap`.
  float value_anywhere(const V3& index) const {
    LS_COUNT(density);
    const V3 q = wrap_ == Wrap::clamp ? index : wrapped(index);
    return lookup_ == Lookup::trilinear ? trilinear(q) : untrilinear(q);
  }
  float trilinear(const V3& index) const {
    if (!voxels_.dense()) [[unlikely]]
      return trilinear_in_bricks(index);
    return interpolated(index, [&](const int(&c)[3]) { return voxels_.corners(c[0], c[1], c[2]); });
  }
  // Returns the value of the node whose cell contains the point. A point on a face between two cells belongs
  // to the cell with the higher index.
  float nearest(const V3& index) const {
    int i[3];
    const float q[3] = {index.x, index.y, index.z};
    for (int k = 0; k < 3; ++k) i[k] = static_cast<int>(std::min(std::max(0.f, q[k]), top_[k]) + .5f);
    return voxels_.at(i[0], i[1], i[2]);
  }
  float untrilinear(const V3& index) const {
    return lookup_ == Lookup::nearest ? nearest(index) : computed(index);
  }
  // Bounds the values in the box [lo, hi], in index coordinates, of a grid that is 0 outside of its domain.
  ValueBounds bounds(const V3d& lo, const V3d& hi) const;

  int cell_size() const { return cell_size_; }
  std::array<int, 3> cells() const { return cells_; }
  const MacroCell& cell(int x, int y, int z) const {
    return macro_[(static_cast<std::size_t>(z) * cells_[1] + y) * cells_[0] + x];
  }
  const MacroCell& cell(std::size_t number) const { return macro_[number]; }
  bool in_domain(const V3& index) const {
    for (int i = 0; i < 3; ++i)
      if (!(index[i] >= lo_[i] && index[i] <= hi_[i])) return false;
    return true;
  }
  V3 domain_lo() const { return lo_; }
  V3 domain_hi() const { return hi_; }
  float max_value() const { return max_value_; }
  const Voxels& voxels() const { return voxels_; }
  std::uint64_t majorant_bytes() const { return macro_.size() * sizeof(MacroCell); }
  std::uint64_t bytes() const { return voxels_.bytes() + majorant_bytes(); }

  // Sets the width of the macro cells to `size` voxels along each axis, regardless of the density. Grids that
  // are traversed together need cells of the same size. If a BuildStop is set, cells may be left empty.
  void use_cells(int size);
  bool same_values(const Grid& other) const { return voxels_ == other.voxels_; }
  // Returns the grid whose values are the means of those of a, b and c, which must have the same shape.
  static Grid mean(const Grid& a, const Grid& b, const Grid& c);

  // Returns the number of values above `limit`, which is at least 0.
  std::uint64_t count_above(float limit) const;

  // Integrates the values along origin + t direction, in index coordinates, over the finite interval [t0,
  // t1]. It stops early where the integral reaches `wanted`. Stored values are integrated voxel by voxel,
  // exactly up to float32 rounding; a field by adaptive quadrature, about as exactly. Used instead of
  // tracking where a tracker would have more collisions than the ray crosses voxels.
  Passage pass(const V3& origin, const V3& direction, float t0, float t1,
               double wanted = std::numeric_limits<double>::infinity()) const;

 private:
  friend class CellWalk;
  // Defined in the tests, which compare integrals along rays with it.
  friend double exact_integral(const Grid&, const V3d& o, const V3d& d, double t0, double t1);
  // Interpolates between the eight nodes around a point. corners_of gives their values for the indices of the
  // lowest of them.
  template <class CornersOf>
  float interpolated(const V3& index, const CornersOf& corners_of) const {
    int cell[3];
    float f[3];
    const float q[3] = {index.x, index.y, index.z};
    for (int k = 0; k < 3; ++k) {
      const float c = std::min(std::max(0.f, q[k]), top_[k]);  // this order maps NaN to 0
      cell[k] = std::min(static_cast<int>(c), last_[k]);
      f[k] = c - static_cast<float>(cell[k]);
    }
    const std::array<float, 8> v = corners_of(cell);
    const float c00 = v[0] + f[0] * (v[1] - v[0]), c10 = v[2] + f[0] * (v[3] - v[2]);
    const float c01 = v[4] + f[0] * (v[5] - v[4]), c11 = v[6] + f[0] * (v[7] - v[6]);
    const float c0 = c00 + f[1] * (c10 - c00), c1 = c01 + f[1] * (c11 - c01);
    return std::max(0.f, c0 + f[2] * (c1 - c0));
  }
  // Not inlined, so that it does not slow down the code for grids that are one array.
  [[gnu::noinline]] float trilinear_in_bricks(const V3& index) const;
  V3 wrapped(const V3& index) const;
  int wanted_cell_size(double density_to_sigma) const;
  std::array<int, 3> cell_counts(int cell_size) const;
  float computed(const V3& index) const;
  MacroCell bound_cell(int x, int y, int z) const;
  MacroCell bound_field(int x, int y, int z) const;
  Passage pass_field(const V3d& o, const V3d& d, double t0, double t1, double wanted) const;

  Voxels voxels_;
  std::array<int, 3> last_{};
  std::array<float, 3> top_{};
  V3 lo_, hi_;
  Affine exact_;  // world to index, not rounded to float32
  Lookup lookup_ = Lookup::trilinear;
  const Field* field_ = nullptr;  // set with Lookup::field
  Wrap wrap_ = Wrap::clamp;
  // True if the given nodes are surrounded by a layer of nodes copied from the opposite end
  bool padded_ = false;
  float max_value_ = 0;
  int cell_size_ = 8;
  std::array<int, 3> cells_{};
  std::vector<MacroCell> macro_;
};

// Traverses the macro cells along a ray: for (CellWalk w(grid, o, d, t0, t1); w.next();) use w.cell(),
// [w.begin(), w.end()]. Distances and positions are relative to the point of entry into the grid, which is
// computed in double: a float32 distance from a far origin cannot resolve the voxels of a small grid
// (docs/measurements/stability.md N11). Boundaries are computed from integer cell indices, never by
// accumulating steps, and intervals never run backwards. A non-finite ray traverses nothing.
class CellWalk {
 public:
  CellWalk(const Grid& grid, const V3& o, const V3& d, float t0, float t1);
  bool next() {
    if (!(end_ < stop_)) return false;
    LS_COUNT(macro_cells);
    if (started_) {
      const int k = exit_[0] < exit_[1] ? (exit_[0] < exit_[2] ? 0 : 2) : (exit_[1] < exit_[2] ? 1 : 2);
      if (--left_[k] < 0) return false;
      cell_ += stride_[k];
      plane_[k] += step_[k];
      exit_[k] = boundary(k);
    }
    started_ = true;
    begin_ = end_;
    end_ = std::max(begin_, std::min(stop_, std::min(exit_[0], std::min(exit_[1], exit_[2]))));
    return true;
  }
  const MacroCell& cell() const { return *cell_; }
  // Returns the index of the current cell in the cell table of `walked`, which must be the traversed grid.
  std::size_t number(const Grid& walked) const {
    return static_cast<std::size_t>(cell_ - walked.macro_.data());
  }
  // The ends of the current cell on the ray, as distances from the point of entry.
  float begin() const { return begin_; }
  float end() const { return end_; }
  // The distance from the ray's origin to the point of entry into the grid.
  double entry() const { return entry_; }
  // The index coordinates at distance t from the point of entry: origin() + t * direction().
  V3 index(float t) const { return origin_ + direction_ * t; }
  const V3& origin() const { return origin_; }
  const V3& direction() const { return direction_; }

 private:
  float boundary(int axis) const { return first_[axis] + plane_[axis] * spacing_[axis]; }

  const MacroCell* cell_ = nullptr;
  double entry_ = 0;
  V3 origin_, direction_;
  // The walk's state along each axis. Boundary number i between cells is at the distance first_ + i *
  // spacing_ from the point of entry. The walk leaves the current cell through boundary number plane_, at the
  // distance exit_. The number of the boundary after that is plane_ + step_, where step_ is 1 or -1. left_ is
  // the number of cells still ahead, and stride_ is what to add to a cell's index in the cell table to get
  // that of the next cell.
  float plane_[3], step_[3], first_[3], spacing_[3], exit_[3];
  int left_[3];
  std::ptrdiff_t stride_[3];
  float begin_ = 0, end_ = 0, stop_ = 0;
  bool started_ = false;
};

inline CellWalk::CellWalk(const Grid& grid, const V3& o, const V3& d, float t0, float t1) {
  const V3d p = grid.exact_.point(V3d(o)), v = grid.exact_.vector(V3d(d));
  if (!std::isfinite(p.x + p.y + p.z + v.x + v.y + v.z)) return;
  // If a component of the direction is so small that the ray cannot cross a cell along that axis, the ray
  // counts as parallel to the two faces of the domain that are perpendicular to the axis. Such a ray misses
  // the grid if its origin is not between these faces.
  constexpr double kParallel = 1e-20;
  double from = t0, to = t1, inverse[3];
  for (int k = 0; k < 3; ++k) {
    const double lo = grid.lo_[k] - p[k], hi = grid.hi_[k] - p[k];
    if (std::abs(v[k]) < kParallel) {
      if (lo > 0 || hi < 0) return;
      inverse[k] = 0;
      continue;
    }
    inverse[k] = 1 / v[k];
    const double a = lo * inverse[k], b = hi * inverse[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  const double length = to - from;
  if (!(length > 0 && length < std::numeric_limits<float>::max())) return;
  entry_ = from;
  stop_ = static_cast<float>(length);
  origin_ = V3(p + v * from);
  direction_ = V3(v);
  // The size is a power of two, so that its reciprocal is exact.
  const auto size = static_cast<float>(grid.cell_size_), per_size = 1 / size;
  const std::ptrdiff_t strides[3] = {1, grid.cells_[0], std::ptrdiff_t{grid.cells_[0]} * grid.cells_[1]};
  cell_ = grid.macro_.data();
  for (int k = 0; k < 3; ++k) {
    const int at =
        std::min(static_cast<int>(std::max(0.f, (origin_[k] - grid.lo_[k]) * per_size)), grid.cells_[k] - 1);
    cell_ += at * strides[k];
    if (inverse[k] == 0) {
      left_[k] = 0;
      exit_[k] = std::numeric_limits<float>::infinity();
      continue;
    }
    const bool up = inverse[k] > 0;
    left_[k] = up ? grid.cells_[k] - 1 - at : at;
    stride_[k] = up ? strides[k] : -strides[k];
    step_[k] = up ? 1.f : -1.f;
    plane_[k] = static_cast<float>(up ? at + 1 : at);
    const auto per_index = static_cast<float>(inverse[k]);
    first_[k] = (grid.lo_[k] - origin_[k]) * per_index;
    spacing_[k] = size * per_index;
    exit_[k] = boundary(k);
  }
}

}  // namespace ls::render
