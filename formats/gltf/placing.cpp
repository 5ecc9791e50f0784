// Computes the transforms of nodes, cameras and lights.
#include <algorithm>
#include <cmath>

#include "formats/gltf/translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

// Returns the transform to the world of a camera at the point `at` that looks in the direction `along`. As in
// Mitsuba, +x of a camera points to the left of its image. nullopt: `along` or `up` is 0, or they are
// parallel.
std::optional<Transform> upright(const Vec3& at, const Vec3& along, const Vec3& up) {
  const auto ahead = unit(along);
  const auto left = ahead ? unit(cross(up, *ahead)) : std::nullopt;
  if (!left) return std::nullopt;
  return of_columns(*left, cross(*ahead, *left), *ahead, at);
}

}  // namespace

// Returns the transform that scales, then rotates, then moves by `move`. `rotation`: a quaternion x, y, z, w
// of any length but 0.
Transform composed(const Vec3& move, const std::array<double, 4>& rotation, const Vec3& scale) {
  auto [x, y, z, w] = rotation;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  Transform out;
  x /= length, y /= length, z /= length, w /= length;
  const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                       2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                       2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) out.m[4 * i + k] = r[3 * i + k] * scale[k];
    out.m[4 * i + 3] = move[i];
  }
  return out;
}

Transform matrix_of(const std::array<double, 16>& by_columns) {
  Transform out;
  for (std::size_t i = 0; i < 16; ++i) out.m[4 * (i % 4) + i / 4] = by_columns[i];
  return out;
}

// Returns the transform of a node relative to its parent. It is the node's matrix if it has one. Otherwise it
// is composed of the node's translation, rotation and scale; `pose` has the values that an animation puts in
// place of these.
Transform local_transform(const Item& node, const Pose& pose) {
  if (node["matrix"].given())
    return matrix_of(node["matrix"].numbers<16>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  const auto move = pose.translation.value_or(node["translation"].numbers<3>({0, 0, 0}));
  const auto scale = pose.scale.value_or(node["scale"].numbers<3>({1, 1, 1}));
  const auto turn = pose.rotation.value_or(node["rotation"].numbers<4>({0, 0, 0, 1}));
  if (std::isnormal(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]))
    return composed(Vec3{move}, turn, Vec3{scale});
  (pose.rotation ? node : node["rotation"])
      .error("a rotation is a quaternion of length 1, and this one has no length");
  return {};
}

std::optional<Transform> facing(const Transform& to_world) {
  const Vec3 back = column(to_world, 2);
  return upright(column(to_world, 3), Vec3{{-back[0], -back[1], -back[2]}}, column(to_world, 1));
}

Transform looking(const Vec3& eye, const Vec3& target) {
  return upright(eye, minus(target, eye), Vec3{{0, 1, 0}}).value_or(Transform{});
}

void Box::include(const Vec3& p) {
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] = std::min(low[i], p[i]);
    high[i] = std::max(high[i], p[i]);
  }
}

void Box::include(const Box& other, const Transform& to_world) {
  if (other.is_empty()) return;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = corner >> i & 1 ? other.high[i] : other.low[i];
    include(transform_point(to_world, p));
  }
}

}  // namespace ls::scene::gltf
