// Perspective camera with an optional thin lens; Mitsuba's conventions (looks along +z, +x to the left of the
// image).
#pragma once

#include "common/image/frame.h"
#include "common/scene/scene.h"
#include "worker/render/math.h"

namespace ls::render {

struct CameraRay {
  V3 o, d;      // d is of unit length
  float t_max;  // far clip
};

class Camera {
 public:
  Camera() = default;
  // `center` and `scale` take scene coordinates to world ones: p' = (p - center) * scale.
  Camera(const Sensor& sensor, FrameSize size, V3d center, double scale);

  // fx, fy: position on the film in pixels, (0, 0) its top left corner; lens in [0, 1)^2, unused by a
  // pinhole.
  CameraRay ray(double fx, double fy, V2 lens) const;
  bool has_lens() const { return aperture_ > 0; }

 private:
  V3d axis_x_, axis_y_, axis_z_;  // of the camera, in the world; columns of to_world, lengths as given
  V3 origin_;
  V3 lens_x_, lens_y_;  // the same axes in world units
  double x0_ = 0, dx_ = 0, y0_ = 0,
         dy_ = 0;                   // camera-space direction (x, y, 1) of film position: x = x0 + dx * fx
  float aperture_ = 0, focus_ = 1;  // scene units
  float near_ = 0, far_ = 0;        // world units
};

}  // namespace ls::render
