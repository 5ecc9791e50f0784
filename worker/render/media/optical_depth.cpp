#include "worker/render/media/optical_depth.h"

#include <algorithm>

namespace ls::render {
namespace {

// Returns dx / dt in a macro cell: about the cell's mean density, but at least 2^-10 of its largest density.
// So the rate is above 0 wherever the density is, even in a cell with one dense voxel, whose mean may round
// to 0.
float rate_of(const MacroCell& cell) { return std::max(cell.control, cell.hi * 0x1p-10f); }

}  // namespace

template <bool kHeight>
void OpticalDepthOf<kHeight>::measure() {
  double total = 0;
  to_ = 0;
  for (CellWalk w(*medium_->density, o_, d_, 0, t_max_); w.next();) {
    const float rate = rate_of(w.cell());
    if (!(rate > 0)) continue;
    if (!(total > 0)) from_ = static_cast<float>(w.entry() + w.begin());
    to_ = std::min(t_max_, static_cast<float>(w.entry() + w.end()));
    total += double{rate} * (w.end() - w.begin());
  }
  total_ = static_cast<float>(total);
}

template <bool kHeight>
DepthPoint OpticalDepthOf<kHeight>::grid_at(float t) const {
  double passed = 0;
  Point last{t, 0, 0, {0, 0, 0}};
  for (CellWalk w(*medium_->density, o_, d_, 0, t_max_); w.next();) {
    const auto local = static_cast<float>(t - w.entry());
    const float rate = rate_of(w.cell());
    if (local < w.end() && !(rate > 0) && t == to_) break;
    if (local < w.end())
      return {t, static_cast<float>(passed + double{rate} * std::max(0.f, local - w.begin())), rate,
              w.index(std::max(local, w.begin()))};
    passed += double{rate} * (w.end() - w.begin());
    last = {t, static_cast<float>(passed), rate, w.index(w.end())};
  }
  // If the ray's origin is far away, rounding may move t to the very end of the medium, beyond the last cell.
  // Then the point is in the last non-empty cell.
  return t <= to_ ? last : Point{t, total_, 0, {0, 0, 0}};
}

template <bool kHeight>
void OpticalDepthOf<kHeight>::at_each(std::span<const float> t, std::span<double> x) const {
  if (!medium_->grid) {
    for (std::size_t i = 0; i < t.size(); ++i) {
      x[i] = std::clamp(t[i], 0.f, t_max_);
      if (falls()) x[i] = height().depth(x[i]);
    }
    return;
  }
  double passed = 0;
  std::size_t i = 0;
  for (CellWalk w(*medium_->density, o_, d_, 0, t_max_); w.next();) {
    const double rate = rate_of(w.cell()), begin = w.entry() + w.begin(), end = w.entry() + w.end();
    for (; i < t.size() && t[i] < end; ++i) x[i] = passed + rate * std::max(0., t[i] - begin);
    passed += rate * (end - begin);
  }
  for (; i < t.size(); ++i) x[i] = passed;
}

template <bool kHeight>
DepthPoint OpticalDepthOf<kHeight>::grid_after(float x) const {
  double passed = 0;
  for (CellWalk w(*medium_->density, o_, d_, 0, t_max_); w.next();) {
    const float rate = rate_of(w.cell());
    const double here = double{rate} * (w.end() - w.begin());
    if (here > 0 && passed + here >= x) {
      const auto local = std::clamp(w.begin() + static_cast<float>((x - passed) / rate), w.begin(), w.end());
      return {static_cast<float>(w.entry() + local), x, rate, w.index(local)};
    }
    passed += here;
  }
  return {to_, total_, 0, {0, 0, 0}};  // reached only if rounding has put x beyond total_
}

template <bool kHeight>
C3 OpticalDepthOf<kHeight>::grid_scattering(const Point& at_point, const V3& p) const {
  if (medium_->by_channel[0]) return medium_->scattering_at(p) * densities(*medium_, at_point.index);
  const Grid& g = *medium_->density;
  const float density =
      g.lookup() == Lookup::trilinear ? g.trilinear(at_point.index) : g.untrilinear(at_point.index);
  return medium_->scattering_at(p) * density;
}

template class OpticalDepthOf<false>;
template class OpticalDepthOf<true>;

}  // namespace ls::render
