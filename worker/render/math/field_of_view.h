// Fields of view of cameras and projectors.
#pragma once

#include <cmath>

#include "core/scene/scene_shapes.h"
#include "worker/render/math/math.h"

namespace ls::render {

// Returns the tangent of half the horizontal field of view. `fov` is the field of view in degrees along
// `axis`; `aspect` is the width of the frame over its height.
inline double tan_half_fov_x(double fov, FovAxis axis, double aspect) {
  const double t = std::tan(fov * (kPiD / 360));
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

}  // namespace ls::render
