// Perspective camera with an optional thin lens, orthographic and spherical ones; Mitsuba's conventions
// (looks along +z, +x to the left of the image).
#pragma once

#include "common/image/frame.h"
#include "common/scene/scene.h"
#include "worker/render/math.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

struct CameraRay {
  V3 o, d;      // d is of unit length
  float t_max;  // far clip
};

class Camera {
 public:
  Camera() = default;
  // `size` is that of the whole frame, in pixels. `center` and `scale` take scene coordinates to world ones:
  // p' = (p - center) * scale. `textures`, which must live as long as the camera, is for a sensor that has an
  // aperture_scale.
  Camera(const Sensor& sensor, FrameSize size, V3d center, double scale,
         const TextureTable* textures = nullptr);

  // fx, fy: position on the whole frame in pixels, (0, 0) its top left corner; lens in [0, 1)^2, unused by a
  // pinhole.
  CameraRay ray(double fx, double fy, V2 lens) const;
  // Whether all its rays have a beginning and a direction in the range of float32.
  bool usable() const;
  // From the camera, or its lens, to where a ray of this direction starts.
  float near_distance(const V3& d) const;
  bool has_lens() const { return aperture_ > 0; }
  Projection projection() const { return projection_; }

 private:
  CameraRay perspective_ray(const V3& o, const V3d& local) const;  // from o, along this in camera space
  CameraRay lens_ray(double x, double y, float aperture, V2 lens) const;
  CameraRay orthographic_ray(double x, double y) const;
  CameraRay spherical_ray(double u, double v) const;
  float aperture_at(double u, double v) const;

  Projection projection_ = Projection::perspective;
  bool pinhole_ = true;           // perspective, without a lens
  V3d axis_x_, axis_y_, axis_z_;  // of the camera, in the world; columns of to_world, lengths as given
  V3 origin_;
  V3 lens_x_, lens_y_;  // the same axes in world units
  double x0_ = 0, dx_ = 0, y0_ = 0,
         dy_ = 0;                   // camera-space direction (x, y, 1) of film position: x = x0 + dx * fx
  float aperture_ = 0, focus_ = 1;  // scene units
  float near_ = 0, far_ = 0;        // world units
  double per_pixel_x_ = 1, per_pixel_y_ = 1;  // shares of the frame
  const TextureTable* textures_ = nullptr;    // with an aperture_scale only
  TextureIndex aperture_scale_;
};

}  // namespace ls::render
