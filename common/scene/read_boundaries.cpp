// What can be told of media and the camera once everything is read.
#include <fmt/format.h>

#include <cmath>

#include "common/base/overloaded.h"
#include "common/scene/reader.h"
#include "common/scene/transform.h"

namespace ls::scene {
namespace {

// p in the space that t takes to the scene's (Cramer's rule); t has an inverse.
Vec3 local_point(const Transform& t, const Vec3& p) {
  const Vec3 q{p[0] - t.m[3], p[1] - t.m[7], p[2] - t.m[11]};
  Vec3 local;
  for (std::size_t k = 0; k < 3; ++k) {
    Transform replaced = t;
    for (std::size_t row = 0; row < 3; ++row) replaced.m[4 * row + k] = q[row];
    local[k] = determinant3(replaced) / determinant3(t);
  }
  return local;
}

// Whether the point is inside of a shape of which the scene itself says where it is.
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

}  // namespace

// As in Mitsuba it is the sensor that says what the camera is in.
void Reader::warn_of_media_around_camera() {
  if (!sensor_ || scene_.sensor.medium || report_.has_errors()) return;
  const auto& m = scene_.sensor.to_world.m;
  const Vec3 camera{m[3], m[7], m[11]};
  for (std::size_t i = 0; i < scene_.shapes.size() && i < shape_elements_.size(); ++i) {
    const Shape& s = scene_.shapes[i];
    if (!s.interior || s.group || !invertible(s.to_world) || !holds(s, camera)) continue;
    std::string id = "...";
    for (const auto& [element, index] : media_)
      if (index == s.interior && element->find("id")) id = element->get("id");
    return report_.warning(
        sensor_->at,
        fmt::format(
            "the camera is inside of a {} that holds a medium ({}), but its sensor names none, so that "
            "it sees none up to the first boundary, as in Mitsuba: add <ref name=\"medium\" "
            "id=\"{}\"/> to the sensor",
            shape_elements_[i]->get("type"), report_.refer_to(shape_elements_[i]->at, sensor_->at), id));
  }
}

}  // namespace ls::scene
