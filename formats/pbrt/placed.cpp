// The transforms of pbrt's directives.
#include <cmath>
#include <numbers>

#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

// Inverts by Gauss-Jordan elimination with partial pivoting.
std::optional<Transform> inverse(Transform a) {
  Transform b;
  for (std::size_t column = 0; column < 4; ++column) {
    std::size_t best = column;
    for (std::size_t row = column + 1; row < 4; ++row)
      if (std::abs(a.m[4 * row + column]) > std::abs(a.m[4 * best + column])) best = row;
    if (!std::isnormal(a.m[4 * best + column])) return std::nullopt;
    for (std::size_t k = 0; k < 4; ++k) {
      std::swap(a.m[4 * best + k], a.m[4 * column + k]);
      std::swap(b.m[4 * best + k], b.m[4 * column + k]);
    }
    const double pivot = a.m[4 * column + column];
    for (std::size_t k = 0; k < 4; ++k) {
      a.m[4 * column + k] /= pivot;
      b.m[4 * column + k] /= pivot;
    }
    for (std::size_t row = 0; row < 4; ++row) {
      const double factor = a.m[4 * row + column];
      if (row == column || factor == 0) continue;
      for (std::size_t k = 0; k < 4; ++k) {
        a.m[4 * row + k] -= factor * a.m[4 * column + k];
        b.m[4 * row + k] -= factor * b.m[4 * column + k];
      }
    }
  }
  return b;
}

}  // namespace

Placed then(const Placed& outer, const Placed& inner) {
  return {multiply(outer.to, inner.to), multiply(inner.from, outer.from)};
}

Placed moved(const Vec3& by) {
  Placed p;
  for (std::size_t i = 0; i < 3; ++i) {
    p.to.m[4 * i + 3] = by[i];
    p.from.m[4 * i + 3] = -by[i];
  }
  return p;
}

Placed scaled(const Vec3& by) {
  Placed p;
  for (std::size_t i = 0; i < 3; ++i) {
    p.to.m[5 * i] = by[i];
    p.from.m[5 * i] = 1 / by[i];
  }
  return p;
}

Placed turned(double degrees, const Vec3& axis) {
  Placed p;
  const auto a = unit(axis);
  if (!a) return p;
  const double angle = degrees * (std::numbers::pi / 180), s = std::sin(angle), c = std::cos(angle);
  const Vec3& u = *a;
  const double cross[9] = {0, -u[2], u[1], u[2], 0, -u[0], -u[1], u[0], 0};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = u[i] * u[k] * (1 - c) + (i == k ? c : 0) + cross[3 * i + k] * s;
      p.to.m[4 * i + k] = x;
      p.from.m[4 * k + i] = x;
    }
  return p;
}

std::optional<Placed> looking(const Vec3& eye, const Vec3& target, const Vec3& up) {
  const auto ahead = unit(minus(target, eye));
  const auto above = unit(up);
  const auto right = ahead && above ? unit(cross(*above, *ahead)) : std::nullopt;
  if (!right) return std::nullopt;
  // As in pbrt, the transform maps the world to the camera. `from` is its inverse, which places the camera in
  // the world.
  const Transform from = scene::of_columns(*right, cross(*ahead, *right), *ahead, eye);
  const auto to = inverse(from);
  return to ? std::optional(Placed{*to, from}) : std::nullopt;
}

Unscaled without_scale(const Transform& t) {
  Unscaled out{t};
  const double scale = std::cbrt(std::abs(determinant3(t)));
  if (!std::isnormal(scale) || !is_similarity(t) || std::abs(scale - 1) < 1e-9) return out;
  out.scale = scale;
  for (std::size_t i = 0; i < 12; ++i)
    if (i % 4 != 3) out.rigid.m[i] /= scale;
  return out;
}

std::optional<Placed> of_columns(const std::vector<double>& m) {
  Placed p;
  for (std::size_t i = 0; i < 16; ++i) p.to.m[4 * (i % 4) + i / 4] = m[i];
  const auto from = inverse(p.to);
  if (!from) return std::nullopt;
  p.from = *from;
  return p;
}

}  // namespace ls::scene::pbrt
