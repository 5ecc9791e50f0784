// The matrices by which programs for compositing find where a point of the scene lies in an image.
#pragma once

#include <array>
#include <optional>

namespace ls {

// A matrix for row vectors, row by row: p' = (x, y, z, 1) M, so that the last row has the translation, and a
// point is (x' / w', y' / w', z' / w'). OpenEXR stores matrices like this.
using RowMatrix = std::array<double, 16>;

// Both are as OpenEXR's standard attributes of these names define them (ImfStandardAttributes.h), which are
// those of RenderMan.
struct CameraMatrices {
  // To a left-handed space: origin at the camera, +x to the right of the image, +y up, +z into the scene.
  RowMatrix world_to_camera{};
  // To x and y from (0, 0), the upper left corner of the image, to (1, 1), its lower right corner; z is 0 on
  // the near and 1 on the far plane. nullopt: no matrix does that, as for a spherical camera.
  std::optional<RowMatrix> world_to_ndc;
  bool operator==(const CameraMatrices&) const = default;
};

}  // namespace ls
