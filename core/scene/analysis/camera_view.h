// Computes the part of the frame that an image shows, and the matrices from the world to the image.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "core/image/frame/camera_matrices.h"
#include "core/image/frame/frame.h"
#include "core/scene/scene.h"

namespace ls::scene {

// Returns the tangent of half the horizontal field of view. `fov` is the field of view in degrees along
// `axis`; `aspect` is the width of the frame over its height.
inline double tan_half_fov_x(double fov, FovAxis axis, double aspect) {
  const double t = std::tan(fov * (std::numbers::pi / 360));
  switch (axis) {
    case FovAxis::x:
      return t;
    case FovAxis::y:
      return t * aspect;
    case FovAxis::smaller:
      return aspect > 1 ? t * aspect : t;
    case FovAxis::larger:
      return aspect > 1 ? t : t * aspect;
    case FovAxis::diagonal:
      return t * aspect / std::sqrt(1 + aspect * aspect);
  }
  return t;
}

// An image as a part of the full frame, in pixels: the size of the frame, and the place of the image's top
// left pixel in it.
struct FramePart {
  FrameSize frame;
  int x0 = 0, y0 = 0;
};
// Returns which part of the frame an image of this size shows. Without a crop, it is the frame. If the film
// has a crop of another size, the full frame is scaled accordingly.
FramePart frame_part(const FilmSettings& film, FrameSize image);

// Returns the matrices of an image of this size. nullopt: `to_world` cannot be inverted, or the numbers are
// too large for the floats of an EXR. A lens has those of its middle.
std::optional<CameraMatrices> camera_matrices(const Sensor& sensor, const FilmSettings& film,
                                              FrameSize image);

}  // namespace ls::scene
