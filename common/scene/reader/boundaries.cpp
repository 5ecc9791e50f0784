// Checks media and camera after the whole scene has been read.
#include <fmt/format.h>

#include "common/scene/analysis/shape_place.h"
#include "common/scene/reader/reader.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene {

// Warns if the camera is inside a shape with an interior medium but has no `medium` itself: as in Mitsuba,
// only the sensor's `medium` says in which medium the camera is.
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
