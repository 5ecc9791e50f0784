// Perspective (with optional thin lens), orthographic and spherical cameras, in Mitsuba's conventions: the
// camera looks along its +z axis, and its +x axis points to the left of the image. Also declares
// PixelFilter, the reconstruction filters.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "core/image/frame/frame.h"
#include "core/scene/analysis/camera_view.h"
#include "core/scene/motion.h"
#include "core/scene/scene.h"
#include "worker/render/camera/meters.h"
#include "worker/render/math/math.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

using scene::tan_half_fov_x;

struct CameraRay {
  V3 o, d;         // d has unit length
  float t_max;     // distance along the ray at which the camera clips it; may be infinite
  float time = 0;  // of the exposure, from 0 to 1
  // Set if a meter measures along this ray. If the meter has a plate, o is on the plate, and the ray meets
  // the plate at once: its normal is -d.
  const MeterStart* meter = nullptr;
};

class Camera {
 public:
  Camera() = default;
  // `size` is the size of the whole frame in pixels. `center` and `scale` map scene to world coordinates: p'
  // = (p - center) * scale. `textures` is needed only for sensors with an aperture_scale, and must then
  // outlive the camera.
  Camera(const Sensor& sensor, FrameSize size, V3d center, double scale,
         const TextureTable* textures = nullptr);
  // Makes what a scene of meters has instead of a camera. The arguments must outlive it.
  Camera(const Meters& meters, const LightWorld& world)
      : projection_(Projection::meters), pinhole_(false), meters_(&meters), world_(&world) {}

  // Returns the ray through the position (fx, fy) of the whole frame, in pixels from its top left corner.
  // `lens`, in [0, 1)^2, chooses the point on the lens; a camera without a lens ignores it. Of a camera that
  // moves it is the ray in the middle of the exposure.
  CameraRay ray(double fx, double fy, V2 lens) const { return ray(pose_, fx, fy, lens); }
  // Returns the ray at a time of the exposure, from 0 to 1.
  CameraRay ray_at(float time, double fx, double fy, V2 lens) const;
  bool moves() const { return !motion_.empty(); }
  // True if the origins and directions of all rays of this camera are in the range of float32.
  bool usable() const;
  // Returns the distance from the camera, or from its lens, to the start of one of its rays.
  float near_distance(const CameraRay& ray) const {
    if (!moves() || projection_ == Projection::spherical) return near_distance(pose_, ray.d);
    return near_distance(pose_at(ray.time), ray.d);
  }
  // Returns the lower and the upper corner of a box around everything that rays of the frame, and of `pixels`
  // around it, pass between the lens and the near plane, enlarged by a thousandth of its distance. Not for
  // spherical cameras, which have no near plane, and not for cameras that move.
  std::pair<V3d, V3d> before_near_plane(double pixels) const;
  bool has_lens() const { return aperture_ > 0; }
  Projection projection() const { return projection_; }

 private:
  struct Pose {
    V3d axis_x, axis_y, axis_z;  // columns of to_world: the camera's axes in the world, not normalised
    V3 origin;
    V3 lens_x, lens_y;  // axis_x and axis_y times the scale from scene to world
  };
  Pose pose(const Transform& to_world) const;
  Pose pose_at(float time) const;
  bool usable(const Pose& pose) const;

  CameraRay ray(const Pose& pose, double fx, double fy, V2 lens) const;
  // Returns the ray from o in the camera-space direction `local`.
  CameraRay perspective_ray(const Pose& pose, const V3& o, const V3d& local) const;
  CameraRay lens_ray(const Pose& pose, double x, double y, float aperture, V2 lens) const;
  CameraRay orthographic_ray(const Pose& pose, double x, double y) const;
  CameraRay spherical_ray(const Pose& pose, double u, double v) const;
  float near_distance(const Pose& pose, const V3& d) const;
  CameraRay meter_ray(double fx, double fy, V2 lens) const;
  float aperture_at(double u, double v) const;

  Projection projection_ = Projection::perspective;
  bool pinhole_ = true;  // true for a perspective camera without a lens
  V3d center_;
  double scale_ = 1;
  Pose pose_;  // of a camera that moves: in the middle of the exposure
  scene::Motion motion_;
  // The film position (fx, fy), in pixels, has the direction (x, y, 1) in camera space, where x = x0_ + dx_ *
  // fx and y = y0_ + dy_ * fy.
  double x0_ = 0, dx_ = 0, y0_ = 0, dy_ = 0;
  float aperture_ = 0, focus_ = 1;  // radius of the lens and focus distance, in scene units
  float near_ = 0, far_ = 0;        // clip distances: those of the scene times the scale
  double spread_ = 1;  // how many times as wide as the lens its rays are at most, up to the near plane
  double per_pixel_x_ = 1, per_pixel_y_ = 1;  // width and height of a pixel over those of the frame
  const TextureTable* textures_ = nullptr;    // set only if the sensor has an aperture_scale
  TextureIndex aperture_scale_;
  const Meters* meters_ = nullptr;  // with Projection::meters, as is world_
  const LightWorld* world_ = nullptr;
};

// Applies a reconstruction filter by importance sampling. Each sample belongs to one pixel, and its position
// is drawn from the filter around that pixel; so no sample contributes to the pixels of another tile (Ernst,
// Stamminger, Greiner 2006). Filters with negative lobes are read as a Gaussian.
class PixelFilter {
 public:
  PixelFilter() = default;
  explicit PixelFilter(const ReconstructionFilter& filter);
  // Returns the offset of a sample from the pixel's centre along one axis, in pixels, for the random number u
  // in [0, 1).
  double offset(float u) const;
  // The largest absolute value of an offset, in pixels.
  double reach() const { return radius_; }

 private:
  enum class Kind { box, tent, table } kind_ = Kind::box;
  double radius_ = .5;
  // For Kind::table: the filter's cumulative distribution at cdf_.size() equally spaced points from -radius_
  // to radius_, both included
  std::vector<double> cdf_;
};

}  // namespace ls::render
