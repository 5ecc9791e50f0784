#include "worker/render/media/field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/overloaded.h"
#include "worker/render/base/kinds.h"

namespace ls::render {
namespace {

struct ImageBox {
  V3d lo, hi;
};
// Returns the smallest box that contains the image of the box [lo, hi].
ImageBox image_of(const Affine& map, const V3d& lo, const V3d& hi) {
  const V3d middle = map.point((lo + hi) * .5), half = (hi - lo) * .5;
  V3d reach(0);
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) reach[k] += std::abs(map.a[static_cast<std::size_t>(3 * k + j)]) * half[j];
  return {middle - reach, middle + reach};
}

double share(const Field::Mapped& m, float value) {
  const double t = std::clamp((value - m.in_low) / (m.in_high - m.in_low), 0., 1.);
  return m.gamma == 1 ? t : std::pow(t, m.gamma);
}
// Curves may leave the range from 0 to 1, but no volume has negative values.
float put_out(const Field::Mapped& m, double t) {
  return static_cast<float>(std::max(0., m.out_low + (m.out_high - m.out_low) * t));
}

}  // namespace

double Curve::at(double x) const {
  const std::size_t n = x_.size();
  if (!(x > x_.front())) return y_.front();
  if (!(x < x_.back())) return y_.back();
  std::size_t i = 1;
  while (i + 1 < n && x >= x_[i]) ++i;
  return y_[i - 1] + (x - x_[i - 1]) / (x_[i] - x_[i - 1]) * (y_[i] - y_[i - 1]);
}

void Curve::bound(double a, double b, double& least, double& most) const {
  const double ya = at(a), yb = at(b);
  least = std::min(ya, yb);
  most = std::max(ya, yb);
  for (std::size_t i = 0; i < x_.size(); ++i)
    if (x_[i] > a && x_[i] < b) least = std::min(least, y_[i]), most = std::max(most, y_[i]);
}

namespace {

// Returns the smallest length that the map makes as long as `own`, or less.
double before(const Affine& map, double own) {
  double squares = 0;
  for (const double a : map.a) squares += a * a;
  return own / std::sqrt(squares);
}

}  // namespace

Field::Field(std::vector<Part> parts)
    : parts_(std::move(parts)), finest_(std::numeric_limits<double>::infinity()) {
  for (const Part& part : parts_)
    finest_ = std::min(
        finest_,
        with_kind(part, overloaded{[](const Stored& s) { return before(s.to_own, 1); },
                                   [](const Noisy& n) { return before(n.to_own, n.noise.finest()); },
                                   [](const Cloudy& c) { return before(c.to_own, c.cloud.finest()); },
                                   [](const auto&) { return std::numeric_limits<double>::infinity(); }}));
}

float Field::value_of(const Part& part, const V3d& p) const {
  return with_kind(
      part, overloaded{[](const Constant& c) { return c.value; },
                       [&](const Stored& s) {
                         const V3 q(s.to_own.point(p));
                         return s.grid.in_domain(q) ? s.grid.value_anywhere(q) : 0.f;
                       },
                       [&](const Falling& f) { return static_cast<float>(f.value * f.profile.density(p)); },
                       [&](const Noisy& n) {
                         return std::max(0.f, n.middle + n.span * n.noise.value(n.to_own.point(p)));
                       },
                       [&](const Cloudy& c) { return c.cloud.value(c.to_own.point(p)); },
                       [&](const Product& x) {
                         const float first = value_of(parts_[x.first], p);
                         return first > 0 ? first * value_of(parts_[x.second], p) : 0.f;
                       },
                       [&](const Mapped& m) {
                         const double t = share(m, value_of(parts_[m.of], p));
                         return put_out(m, m.curve.empty() ? t : m.curve[0].at(t));
                       }});
}

ValueBounds Field::bounds_of(const Part& part, const V3d& lo, const V3d& hi) const {
  return with_kind(
      part, overloaded{[](const Constant& c) {
                         return ValueBounds{c.value, c.value};
                       },
                       [&](const Stored& s) {
                         const ImageBox box = image_of(s.to_own, lo, hi);
                         return s.grid.bounds(box.lo, box.hi);
                       },
                       [&](const Falling& f) {
                         double low = f.profile.base, high = low;
                         for (int k = 0; k < 3; ++k) {
                           const double a = f.profile.rise[k] * lo[k], b = f.profile.rise[k] * hi[k];
                           low += std::min(a, b);
                           high += std::max(a, b);
                         }
                         const auto at = [&](double level) {
                           return static_cast<float>(f.value * std::exp(-std::max(0., level)));
                         };
                         return ValueBounds{at(high), at(low)};
                       },
                       [&](const Noisy& n) {
                         const ImageBox box = image_of(n.to_own, lo, hi);
                         const ValueBounds noise = n.noise.bounds(box.lo, box.hi);
                         const float a = n.middle + n.span * noise.lo, b = n.middle + n.span * noise.hi;
                         return ValueBounds{std::max(0.f, std::min(a, b)), std::max(0.f, std::max(a, b))};
                       },
                       [&](const Cloudy& c) {
                         const ImageBox box = image_of(c.to_own, lo, hi);
                         return c.cloud.bounds(box.lo, box.hi);
                       },
                       [&](const Product& x) {
                         const ValueBounds a = bounds_of(parts_[x.first], lo, hi);
                         const ValueBounds b = a.hi > 0 ? bounds_of(parts_[x.second], lo, hi) : ValueBounds{};
                         return ValueBounds{a.lo * b.lo, a.hi * b.hi};
                       },
                       [&](const Mapped& m) {
                         const ValueBounds of = bounds_of(parts_[m.of], lo, hi);
                         double a = share(m, of.lo), b = share(m, of.hi);
                         if (!m.curve.empty()) m.curve[0].bound(a, b, a, b);
                         const float x = put_out(m, a), y = put_out(m, b);
                         return ValueBounds{std::min(x, y), std::max(x, y)};
                       }});
}

std::uint64_t Field::bytes() const {
  std::uint64_t sum = parts_.size() * sizeof(Part);
  for (const Part& part : parts_)
    if (const auto* s = std::get_if<Stored>(&part)) sum += s->grid.bytes();
  return sum;
}

}  // namespace ls::render
