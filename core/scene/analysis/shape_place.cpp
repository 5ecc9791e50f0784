#include "core/scene/analysis/shape_place.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/overloaded.h"
#include "core/scene/transform.h"

namespace ls::scene {
namespace {

// Transforms the point p by the inverse of t, which is computed by Cramer's rule; t must be invertible.
Vec3 local_point(const Transform& t, const Vec3& p) {
  const Vec3 q = minus(p, origin_of(t));
  Vec3 local;
  for (std::size_t k = 0; k < 3; ++k) {
    Transform replaced = t;
    for (std::size_t row = 0; row < 3; ++row) replaced.m[4 * row + k] = q[row];
    local[k] = determinant3(replaced) / determinant3(t);
  }
  return local;
}

Box ball(const Vec3& center, double radius) { return grown({center, center}, radius); }

Box joined(Box a, const Box& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    a.lo[k] = std::min(a.lo[k], b.lo[k]);
    a.hi[k] = std::max(a.hi[k], b.hi[k]);
  }
  return a;
}

std::optional<Box> local_box(const Geometry& g) {
  const Box flat{{-1, -1, 0}, {1, 1, 0}};
  return std::visit(overloaded{[](const MeshShape&) { return std::optional<Box>(); },
                               [](const CubeShape&) {
                                 return std::optional(ball({0, 0, 0}, 1));
                               },
                               [](const SphereShape& s) { return std::optional(ball(s.center, s.radius)); },
                               [](const CylinderShape& s) {
                                 return std::optional(joined(ball(s.p0, s.radius), ball(s.p1, s.radius)));
                               },
                               [&](const auto&) { return std::optional(flat); }},
                    g);
}

}  // namespace

Vec3 corner(const Box& b, int k) {
  return {(k & 1 ? b.hi : b.lo)[0], (k & 2 ? b.hi : b.lo)[1], (k & 4 ? b.hi : b.lo)[2]};
}

Box grown(Box b, double by) {
  for (std::size_t k = 0; k < 3; ++k) {
    b.lo[k] -= by;
    b.hi[k] += by;
  }
  return b;
}

bool touch(const Box& a, const Box& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.lo[k] > b.hi[k] || b.lo[k] > a.hi[k]) return false;
  return true;
}

double largest_coordinate(const Box& b) {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max({most, std::abs(b.lo[k]), std::abs(b.hi[k])});
  return most;
}

std::optional<Box> box_of(const Shape& shape) {
  const auto local = local_box(shape.geometry);
  if (!local) return std::nullopt;
  const Vec3 first = transform_point(shape.to_world, corner(*local, 0));
  Box box{first, first};
  for (int k = 1; k < 8; ++k) {
    const Vec3 p = transform_point(shape.to_world, corner(*local, k));
    box = joined(box, {p, p});
  }
  if (!(largest_coordinate(box) < std::numeric_limits<double>::infinity())) return std::nullopt;
  return box;
}

bool holds(const Shape& shape, const Vec3& p) {
  const Vec3 q = local_point(shape.to_world, p);
  return std::visit(
      overloaded{
          [&](const CubeShape&) { return std::abs(q[0]) < 1 && std::abs(q[1]) < 1 && std::abs(q[2]) < 1; },
          [&](const SphereShape& s) {
            return std::hypot(q[0] - s.center[0], q[1] - s.center[1], q[2] - s.center[2]) < s.radius;
          },
          [](const auto&) { return false; }},
      shape.geometry);
}

}  // namespace ls::scene
