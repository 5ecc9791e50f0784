#include "worker/render/media/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ls::render {
namespace {

// Bounds of a cell are multiplied by kInflate, because interpolation between eight float32 numbers can exceed
// their maximum by a few ulps (docs/measurements/stability.md N09).
constexpr float kInflate = 1 + 4 * 0x1p-23f;

}  // namespace

Grid::Grid(std::array<int, 3> size, std::vector<float> values, const Affine& world_to_index, V3d domain_lo,
           V3d domain_hi, double density_to_sigma, VolumeFilter filter, Wrap wrap)
    : size_(size),
      values_(std::move(values)),
      lo_(domain_lo),
      hi_(domain_hi),
      exact_(world_to_index),
      filter_(filter),
      wrap_(wrap) {
  // Only grids that are repeated and interpolated need the extra nodes of repeat_ends(). A mirrored grid
  // equals a clamped one within half a voxel of its ends, and without interpolation wrapping has no effect
  // inside the domain.
  if (wrap == Wrap::repeat && filter == VolumeFilter::trilinear) repeat_ends();
  for (int k = 0; k < 3; ++k) {
    last_[k] = std::max(0, size_[k] - 2);
    top_[k] = static_cast<float>(size_[k] - 1);
  }
  // On an axis with one node the step is 0, so that a node is its own neighbour.
  step_ = {size_[0] > 1 ? std::size_t{1} : 0, size_[1] > 1 ? static_cast<std::size_t>(size_[0]) : 0,
           size_[2] > 1 ? static_cast<std::size_t>(size_[0]) * size_[1] : 0};
  for (float v : values_) max_value_ = std::max(max_value_, v);
  use_cells(wanted_cell_size(density_to_sigma));
}

// Surrounds the grid by one layer of nodes copied from the opposite end. So interpolation needs no special
// case at the ends, and macro cells also bound the values interpolated there. All index coordinates grow by
// one.
void Grid::repeat_ends() {
  const std::array<int, 3> n = size_;
  const std::vector<float> inner = std::move(values_);
  for (int& s : size_) s += 2;
  values_.clear();
  values_.reserve(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
  const auto from = [&](int i, int k) { return static_cast<std::size_t>((i - 1 + n[k]) % n[k]); };
  for (int z = 0; z < size_[2]; ++z)
    for (int y = 0; y < size_[1]; ++y) {
      const float* row = inner.data() + (from(z, 2) * n[1] + from(y, 1)) * n[0];
      values_.push_back(row[n[0] - 1]);
      values_.insert(values_.end(), row, row + n[0]);
      values_.push_back(row[0]);
    }
  exact_.b = exact_.b + V3d(1);
  lo_ = lo_ + V3(1);
  hi_ = hi_ + V3(1);
  padded_ = true;
}

// Maps an index outside the domain to the index inside that has the same value.
V3 Grid::wrapped(const V3& index) const {
  V3 q = index;
  for (int k = 0; k < 3; ++k) {
    if (q[k] >= lo_[k] && q[k] <= hi_[k]) continue;
    const float width = hi_[k] - lo_[k], turns = (q[k] - lo_[k]) / width, whole = std::floor(turns);
    float part = turns - whole;
    if (wrap_ == Wrap::mirror && std::fmod(whole, 2.f) != 0) part = 1 - part;
    q[k] = lo_[k] + part * width;
  }
  return q;
}

std::uint64_t Grid::count_above(float limit) const {
  const int skip = padded_ ? 1 : 0;
  std::uint64_t n = 0;
  for (int z = skip; z < size_[2] - skip; ++z)
    for (int y = skip; y < size_[1] - skip; ++y) {
      const float* row = values_.data() + (static_cast<std::size_t>(z) * size_[1] + y) * size_[0];
      n += static_cast<std::uint64_t>(
          std::count_if(row + skip, row + size_[0] - skip, [&](float v) { return v > limit; }));
    }
  return n;
}

Grid Grid::mean(const Grid& a, const Grid& b, const Grid& c) {
  Grid m = a;
  m.max_value_ = 0;
  for (std::size_t i = 0; i < m.values_.size(); ++i) {
    m.values_[i] = static_cast<float>((double{a.values_[i]} + b.values_[i] + c.values_[i]) / 3);
    m.max_value_ = std::max(m.max_value_, m.values_[i]);
  }
  m.use_cells(a.cell_size_);
  return m;
}

int Grid::wanted_cell_size(double density_to_sigma) const {
  // The target is that majorant times cell diagonal is about 1.44 (Fong et al. 2017, section 3.3), with cells
  // of 4 to 16 voxels a side. Smaller cells cost more steps than the null collisions they save; larger ones
  // bound the density too loosely.
  const Affine inverse = exact_.inverse();
  const double voxel = inverse.vector({1, 1, 1}).length();
  const double wanted = 1.44 / std::max(1e-30, static_cast<double>(max_value_) * density_to_sigma * voxel);
  return wanted < 3 ? 4 : wanted < 10 ? 8 : 16;
}

void Grid::use_cells(int cell_size) {
  cell_size_ = cell_size;
  for (int k = 0; k < 3; ++k) {
    cells_[k] = std::max(1, static_cast<int>(std::ceil((hi_[k] - lo_[k]) / static_cast<float>(cell_size_))));
  }
  macro_.resize(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2]);
  std::size_t i = 0;
  for (int z = 0; z < cells_[2]; ++z)
    for (int y = 0; y < cells_[1]; ++y)
      for (int x = 0; x < cells_[0]; ++x) macro_[i++] = bound_cell(x, y, z);
}

MacroCell Grid::bound_cell(int x, int y, int z) const {
  // [a, b] is, along each axis, the range of nodes that interpolation inside the cell can use. The cell is
  // enlarged by .01 voxels at each end, because the traversal's positions are rounded.
  int a[3], b[3];
  const int c[3] = {x, y, z};
  for (int k = 0; k < 3; ++k) {
    const float lo = lo_[k] + static_cast<float>(c[k] * cell_size_), hi = lo + static_cast<float>(cell_size_);
    a[k] = std::clamp(static_cast<int>(std::floor(lo - .01f)), 0, size_[k] - 1);
    b[k] = std::clamp(static_cast<int>(std::ceil(hi + .01f)), 0, size_[k] - 1);
  }
  float mn = std::numeric_limits<float>::infinity(), mx = 0;
  double sum = 0;
  std::uint64_t n = 0;
  for (int k = a[2]; k <= b[2]; ++k)
    for (int j = a[1]; j <= b[1]; ++j) {
      const float* row = values_.data() + (static_cast<std::size_t>(k) * size_[1] + j) * size_[0];
      for (int i = a[0]; i <= b[0]; ++i) {
        mn = std::min(mn, row[i]);
        mx = std::max(mx, row[i]);
        sum += row[i];
        ++n;
      }
    }
  MacroCell m;
  m.hi = mx * kInflate;
  // Constant cells need no residual: interpolating equal numbers has no rounding error.
  m.control = mn == mx ? mn : std::clamp(static_cast<float>(sum / static_cast<double>(n)), mn, mx);
  m.residual = std::max(m.hi - m.control, m.control - mn) * kInflate;
  if (mn == mx) m.residual = 0;
  return m;
}

Passage Grid::pass(const V3& origin, const V3& direction, float t0, float t1, double wanted) const {
  const V3d o(origin), d(direction);
  const auto value_at = [&](double t) {
    const V3 q(o + d * t);
    return static_cast<double>(filter_ == VolumeFilter::trilinear ? trilinear(q) : nearest(q));
  };
  // Along a line a trilinear field is a cubic, for which two-point Gauss-Legendre quadrature is exact.
  const auto integral = [&](double a, double length) {
    const double middle = a + length / 2, g = length * .28867513459481288;  // 1 / (2 sqrt 3)
    return length / 2 * (value_at(middle - g) + value_at(middle + g));
  };
  // The planes that separate the field's polynomial pieces go through the nodes or, without interpolation,
  // half way between them.
  const double offset = filter_ == VolumeFilter::trilinear ? 0 : .5;
  double plane[3], exit[3];
  for (int k = 0; k < 3; ++k) {
    exit[k] = std::numeric_limits<double>::infinity();
    if (std::abs(d[k]) < 1e-20) continue;
    const double q = o[k] + d[k] * t0 - offset;
    plane[k] = d[k] > 0 ? std::floor(q) + 1 : std::ceil(q) - 1;
    exit[k] = (plane[k] + offset - o[k]) / d[k];
  }
  Passage p;
  for (double a = t0; a < t1;) {
    const int k = exit[0] < exit[1] ? (exit[0] < exit[2] ? 0 : 2) : (exit[1] < exit[2] ? 1 : 2);
    const double b = std::max(a, std::min<double>(t1, exit[k])), here = integral(a, b - a);
    if (p.integral + here >= wanted) {
      const double rest = wanted - p.integral;
      // The point is found by Newton's method with a bracket, which works because the integral is monotonic.
      double lo = 0, hi = b - a, h = here > 0 ? hi * std::min(1., rest / here) : 0;
      for (int i = 0; i < 32; ++i) {
        const double excess = integral(a, h) - rest;
        (excess > 0 ? hi : lo) = h;
        double next = h - excess / value_at(a + h);
        if (!(next >= lo && next <= hi)) next = (lo + hi) / 2;
        if (std::abs(next - h) <= 1e-7 * h) break;
        h = next;
      }
      return {true, static_cast<float>(a + h), wanted};
    }
    p.integral += here;
    if (!(exit[k] < t1)) break;
    a = b;
    plane[k] += d[k] > 0 ? 1 : -1;
    exit[k] = (plane[k] + offset - o[k]) / d[k];
  }
  p.t = t1;
  return p;
}

}  // namespace ls::render
