#include "worker/render/media/grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "worker/render/base/build_stop.h"
#include "worker/render/media/field.h"

namespace ls::render {
namespace {

// Bounds of a cell are multiplied by kInflate, because interpolation between eight float32 numbers can exceed
// their maximum by a few ulps (docs/measurements/stability.md N09).
constexpr float kInflate = 1 + 4 * 0x1p-23f;

// A grid has at most kMostCells macro cells, or one for kValuesPerCell values that are stored if those are
// more: each takes as much memory as three values. No array of values needs larger cells because of it.
constexpr std::uint64_t kMostCells = 1 << 22, kValuesPerCell = 16;

// Surrounds values by one layer copied from the opposite end. So interpolation needs no special case at the
// ends, and macro cells also bound the values interpolated there. All index coordinates grow by one.
std::vector<float> with_repeated_ends(const std::array<int, 3>& n, const std::vector<float>& inner) {
  std::vector<float> values;
  values.reserve((static_cast<std::size_t>(n[0]) + 2) * (static_cast<std::size_t>(n[1]) + 2) *
                 (static_cast<std::size_t>(n[2]) + 2));
  const auto from = [&](int i, int k) { return static_cast<std::size_t>((i - 1 + n[k]) % n[k]); };
  for (int z = 0; z < n[2] + 2; ++z)
    for (int y = 0; y < n[1] + 2; ++y) {
      const float* row = inner.data() + (from(z, 2) * n[1] + from(y, 1)) * n[0];
      values.push_back(row[n[0] - 1]);
      values.insert(values.end(), row, row + n[0]);
      values.push_back(row[0]);
    }
  return values;
}

}  // namespace

Grid::Grid(std::array<int, 3> size, std::vector<float> values, const Affine& world_to_index, V3d domain_lo,
           V3d domain_hi, double density_to_sigma, VolumeFilter filter, Wrap wrap) {
  // Only grids that are repeated and interpolated need the extra nodes of with_repeated_ends(). A mirrored
  // grid equals a clamped one within half a voxel of its ends, and without interpolation wrapping has no
  // effect inside the domain.
  const bool padded = wrap == Wrap::repeat && filter == VolumeFilter::trilinear;
  Affine to_index = world_to_index;
  if (padded) {
    values = with_repeated_ends(size, values);
    for (int& n : size) n += 2;
    to_index.b = to_index.b + V3d(1);
    domain_lo = V3d(V3(domain_lo) + V3(1));
    domain_hi = V3d(V3(domain_hi) + V3(1));
  }
  *this =
      Grid(Voxels(size, std::move(values)), to_index, domain_lo, domain_hi, density_to_sigma, filter, wrap);
  padded_ = padded;
}

Grid::Grid(Voxels voxels, const Affine& world_to_index, V3d domain_lo, V3d domain_hi, double density_to_sigma,
           VolumeFilter filter, Wrap wrap)
    : voxels_(std::move(voxels)),
      lo_(domain_lo),
      hi_(domain_hi),
      exact_(world_to_index),
      lookup_(filter == VolumeFilter::trilinear ? Lookup::trilinear : Lookup::nearest),
      wrap_(wrap),
      max_value_(voxels_.largest()) {
  for (std::size_t k = 0; k < 3; ++k) {
    last_[k] = std::max(0, voxels_.size()[k] - 2);
    top_[k] = static_cast<float>(voxels_.size()[k] - 1);
  }
  use_cells(wanted_cell_size(density_to_sigma));
}

Grid::Grid(const Field& field, const Affine& world_to_index, V3d domain_lo, V3d domain_hi, int cell_size)
    : lo_(domain_lo), hi_(domain_hi), exact_(world_to_index), lookup_(Lookup::field), field_(&field) {
  use_cells(cell_size);
  for (const MacroCell& cell : macro_) max_value_ = std::max(max_value_, cell.hi);
}

float Grid::computed(const V3& index) const { return field_->value(index); }

float Grid::trilinear_in_bricks(const V3& index) const {
  return interpolated(index, [&](const int(&c)[3]) { return voxels_.corners_in_bricks(c[0], c[1], c[2]); });
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
  const auto& n = voxels_.size();
  return voxels_.count_above(limit, {skip, skip, skip}, {n[0] - 1 - skip, n[1] - 1 - skip, n[2] - 1 - skip});
}

Grid Grid::mean(const Grid& a, const Grid& b, const Grid& c) {
  Grid m = a;
  m.voxels_ = Voxels::mean(a.voxels_, b.voxels_, c.voxels_);
  m.max_value_ = m.voxels_.largest();
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
  int size = wanted < 3 ? 4 : wanted < 10 ? 8 : 16;
  const auto count = [&] {
    const std::array<int, 3> n = cell_counts(size);
    return static_cast<std::uint64_t>(n[0]) * static_cast<std::uint64_t>(n[1]) *
           static_cast<std::uint64_t>(n[2]);
  };
  while (count() > std::max(kMostCells, voxels_.stored() / kValuesPerCell)) size *= 2;
  return size;
}

std::array<int, 3> Grid::cell_counts(int cell_size) const {
  std::array<int, 3> n;
  for (int k = 0; k < 3; ++k)
    n[static_cast<std::size_t>(k)] =
        std::max(1, static_cast<int>(std::ceil((hi_[k] - lo_[k]) / static_cast<float>(cell_size))));
  return n;
}

void Grid::use_cells(int cell_size) {
  cell_size_ = cell_size;
  cells_ = cell_counts(cell_size_);
  macro_.resize(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2]);
  const std::atomic<bool>* stop = BuildStop::flag();
  std::size_t i = 0;
  for (int z = 0; z < cells_[2] && !(stop && *stop); ++z)
    for (int y = 0; y < cells_[1]; ++y)
      for (int x = 0; x < cells_[0]; ++x)
        macro_[i++] = lookup_ == Lookup::field ? bound_field(x, y, z) : bound_cell(x, y, z);
}

// Bounds the field in a macro cell by its bounds in kBoxesPerSide^3 boxes. Each is enlarged by .01 voxels, as
// cells with values are (bound_cell).
MacroCell Grid::bound_field(int x, int y, int z) const {
  constexpr double kMargin = .01;
  const double side = double{1} * cell_size_ / kBoxesPerSide;
  const V3d corner = V3d(lo_) + V3d(x, y, z) * cell_size_;
  float least = std::numeric_limits<float>::infinity(), most = 0;
  int count = 0;
  for (int k = 0; k < kBoxesPerSide; ++k)
    for (int j = 0; j < kBoxesPerSide; ++j)
      for (int i = 0; i < kBoxesPerSide; ++i) {
        const V3d from = corner + V3d(i, j, k) * side, to = from + V3d(side + kMargin);
        // The last cell along an axis may reach beyond the domain.
        if (count > 0 && (from.x > hi_.x || from.y > hi_.y || from.z > hi_.z)) continue;
        const ValueBounds in = field_->bounds(from - V3d(kMargin), to);
        const bool finite = std::isfinite(in.lo) && std::isfinite(in.hi);
        least = std::min(least, finite ? in.lo : 0);
        most = finite ? std::max(most, in.hi) : std::numeric_limits<float>::infinity();
        ++count;
      }
  MacroCell m;
  m.hi = most * kInflate;
  // The bounds may be far apart where the values are not, and on either side of them. With the lower bound as
  // control value, the factors of ratio tracking are from 0 to 1, and their products vary no more than a way
  // that is open or not.
  m.control = least;
  m.residual = least == most ? 0 : m.hi - least;
  return m;
}

ValueBounds Grid::bounds(const V3d& lo, const V3d& hi) const {
  if (lookup_ == Lookup::field) return field_->bounds(lo, hi);
  bool outside = false;
  Position a, b;
  for (int k = 0; k < 3; ++k) {
    outside = outside || lo[k] < lo_[k] || hi[k] > hi_[k];
    if (lo[k] > hi_[k] || hi[k] < lo_[k]) return {0, 0};
    const auto node = [&](double at) { return std::clamp(static_cast<int>(at), 0, voxels_.size()[k] - 1); };
    a[k] = node(std::floor(std::max(lo[k], double{lo_[k]})));
    b[k] = node(std::ceil(std::min(hi[k], double{hi_[k]})));
  }
  const ValueSums in = voxels_.sums(a, b);
  return {outside ? 0 : in.lo / kInflate, in.hi * kInflate};
}

MacroCell Grid::bound_cell(int x, int y, int z) const {
  // [a, b] is, along each axis, the range of nodes that interpolation inside the cell can use. The cell is
  // enlarged by .01 voxels at each end, because the traversal's positions are rounded.
  Position a, b;
  const int c[3] = {x, y, z};
  double count = 1;
  for (int k = 0; k < 3; ++k) {
    const float lo = lo_[k] + static_cast<float>(c[k] * cell_size_), hi = lo + static_cast<float>(cell_size_);
    const int last = voxels_.size()[k] - 1;
    a[k] = std::clamp(static_cast<int>(std::floor(lo - .01f)), 0, last);
    b[k] = std::clamp(static_cast<int>(std::ceil(hi + .01f)), 0, last);
    count *= b[k] - a[k] + 1;
  }
  const ValueSums in = voxels_.sums(a, b);
  MacroCell m;
  m.hi = in.hi * kInflate;
  // Constant cells need no residual: interpolating equal numbers has no rounding error.
  if (in.lo == in.hi) {
    m.control = in.lo;
    return m;
  }
  m.control = std::clamp(static_cast<float>(in.sum / count), in.lo, in.hi);
  m.residual = std::max(m.hi - m.control, m.control - in.lo) * kInflate;
  return m;
}

namespace {

// Integrates a function by Simpson's rule, on intervals that are halved until the rule and its halves agree,
// and stops where the integral reaches a wanted value.
template <class Value>
class Quadrature {
 public:
  Quadrature(const Value& value, double wanted, double tolerance)
      : value_(value), wanted_(wanted), tolerance_(tolerance) {}

  // Adds the integral from a to b, which go on from the end of the interval before. Returns true at the
  // wanted value.
  bool add(double a, double b) {
    return add({a, value_(a)}, {(a + b) / 2, value_((a + b) / 2)}, {b, value_(b)}, 0);
  }
  double integral() const { return integral_; }
  double end() const { return end_; }  // where the wanted value is reached

 private:
  struct At {
    double t, value;
  };
  static double rule(const At& a, const At& m, const At& b) {
    return (b.t - a.t) / 6 * (a.value + 4 * m.value + b.value);
  }
  bool add(const At& a, const At& m, const At& b, int depth) {
    constexpr int kMostHalvings = 10;
    const At left{(a.t + m.t) / 2, value_((a.t + m.t) / 2)}, right{(m.t + b.t) / 2, value_((m.t + b.t) / 2)};
    const double first = rule(a, left, m), second = rule(m, right, b);
    const double difference = std::abs(first + second - rule(a, m, b));
    if (difference > 15 * tolerance_ * (b.t - a.t) && depth < kMostHalvings)
      return add(a, left, m, depth + 1) || add(m, right, b, depth + 1);
    return take(a, left, m, first) || take(m, right, b, second);
  }
  bool take(const At& a, const At& m, const At& b, double whole) {
    if (integral_ + whole < wanted_) {
      integral_ += whole;
      return false;
    }
    // The point is found by bisection in the integral of the parabola through the three values.
    const double rest = (wanted_ - integral_) / (b.t - a.t), bend = 2 * (a.value - 2 * m.value + b.value),
                 slope = -3 * a.value + 4 * m.value - b.value;
    double lo = 0, hi = 1;
    for (int i = 0; i < 40; ++i) {
      const double u = (lo + hi) / 2;
      (u * (a.value + u * (slope / 2 + u * bend / 3)) < rest ? lo : hi) = u;
    }
    end_ = a.t + hi * (b.t - a.t);
    integral_ = wanted_;
    return true;
  }

  const Value& value_;
  const double wanted_, tolerance_;
  double integral_ = 0, end_ = 0;
};

}  // namespace

Passage Grid::pass_field(const V3d& o, const V3d& d, double t0, double t1, double wanted) const {
  // Intervals of at most half a voxel, and half of the finest cell of noise, with an error of at most this
  // share of the largest density. Longer ones could find the same value at all of their few points.
  constexpr double kInterval = .5, kTolerance = 1e-7, kMostIntervals = 16384;
  const double interval = kInterval * std::min(1., field_->finest());
  const auto value = [&](double t) { return static_cast<double>(computed(V3(o + d * t))); };
  Quadrature sum(value, wanted, kTolerance * max_value_);
  const double length = t1 - t0;
  const int count =
      static_cast<int>(std::clamp(std::ceil(length * d.length() / interval), 1., kMostIntervals));
  for (int i = 0; i < count; ++i)
    if (sum.add(t0 + length * i / count, t0 + length * (i + 1) / count))
      return {true, static_cast<float>(sum.end()), wanted};
  return {false, static_cast<float>(t1), sum.integral()};
}

Passage Grid::pass(const V3& origin, const V3& direction, float t0, float t1, double wanted) const {
  const V3d o(origin), d(direction);
  if (lookup_ == Lookup::field) return pass_field(o, d, t0, t1, wanted);
  const auto value_at = [&](double t) {
    const V3 q(o + d * t);
    return static_cast<double>(lookup_ == Lookup::trilinear ? trilinear(q) : nearest(q));
  };
  // Along a line a trilinear field is a cubic, for which two-point Gauss-Legendre quadrature is exact.
  const auto integral = [&](double a, double length) {
    const double middle = a + length / 2, g = length * .28867513459481288;  // 1 / (2 sqrt 3)
    return length / 2 * (value_at(middle - g) + value_at(middle + g));
  };
  // The planes that separate the field's polynomial pieces go through the nodes or, without interpolation,
  // half way between them.
  const double offset = lookup_ == Lookup::trilinear ? 0 : .5;
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
