#include "worker/render/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/overloaded.h"
#include "worker/render/base/work_counters.h"

namespace ls::render {

Camera::Camera(const Sensor& s, FrameSize size, V3d center, double scale, const TextureTable* textures)
    : projection_(s.projection),
      center_(center),
      scale_(scale),
      pose_(pose(s.to_world)),
      motion_(s.motion),
      per_pixel_x_(1. / size.width),
      per_pixel_y_(1. / size.height) {
  const double aspect = static_cast<double>(size.width) / size.height;
  const double tx = projection_ == Projection::perspective ? tan_half_fov_x(s.fov, s.fov_axis, aspect) : 1,
               ty = tx / aspect;
  // Maps a film position (fx, fy) in pixels to [0, 1] and then to camera space, x to the left and y up. The
  // principal point offset shifts positions to the right and down by fractions of the film.
  const double ox = s.principal_point_offset[0], oy = s.principal_point_offset[1];
  x0_ = tx * (1 - 2 * ox);
  dx_ = -2 * tx / size.width;
  y0_ = ty * (1 - 2 * oy);
  dy_ = -2 * ty / size.height;
  aperture_ = static_cast<float>(s.aperture_radius);
  focus_ = static_cast<float>(s.focus_distance);
  near_ = static_cast<float>(s.near_clip * scale);
  spread_ = 1 + s.near_clip / s.focus_distance;
  far_ = static_cast<float>(s.far_clip * scale);
  pinhole_ = projection_ == Projection::perspective && !(aperture_ > 0);
  if (s.aperture_scale) {
    textures_ = textures;
    aperture_scale_ = *s.aperture_scale;
  }
}

Camera::Pose Camera::pose(const Transform& to_world) const {
  const auto& m = to_world.m;
  Pose p;
  p.axis_x = V3d(m[0], m[4], m[8]);
  p.axis_y = V3d(m[1], m[5], m[9]);
  p.axis_z = V3d(m[2], m[6], m[10]);
  p.origin = V3((V3d(m[3], m[7], m[11]) - center_) * scale_);
  p.lens_x = V3(p.axis_x * scale_);
  p.lens_y = V3(p.axis_y * scale_);
  return p;
}

Camera::Pose Camera::pose_at(float time) const { return pose(motion_.at(double{time})); }

[[gnu::cold, gnu::noinline]] CameraRay Camera::ray_at(float time, double fx, double fy, V2 lens) const {
  CameraRay r = ray(moves() ? pose_at(time) : pose_, fx, fy, lens);
  r.time = time;
  return r;
}

bool Camera::usable() const {
  // Between two keys each part of the pose is between those of the keys.
  return usable(pose_) && std::ranges::all_of(motion_.keys(), [&](const MotionKey& key) {
           return usable(pose(key.to_world));
         });
}

bool Camera::usable(const Pose& pose) const {
  // Before their directions are normalised, the rays of perspective and orthographic cameras depend linearly
  // on the positions on the film and on the lens, so testing a few extreme positions suffices. The rays of a
  // spherical camera all start at one point. An aperture map can only make the lens smaller, so the test
  // leaves it out and uses the whole lens.
  if (projection_ == Projection::meters) return true;  // Meters::build() has tested them
  Camera whole = *this;
  whole.motion_ = {};
  whole.textures_ = nullptr;
  for (const double fx : {0., 1.})
    for (const double fy : {0., 1.})
      for (const V2& lens : {V2(0, 0), V2(0, 1), V2(1, 0), V2(1, 1)}) {
        const CameraRay r = whole.ray(pose, fx / per_pixel_x_, fy / per_pixel_y_, lens);
        const float length = dot(r.d, r.d);
        if (!is_finite(r.o) || !(length > .99f && length < 1.01f) || std::isnan(r.t_max)) return false;
      }
  return true;
}

CameraRay Camera::ray(const Pose& pose, double fx, double fy, V2 lens) const {
  const double x = x0_ + dx_ * fx, y = y0_ + dy_ * fy;
  if (pinhole_) return perspective_ray(pose, pose.origin, {x, y, 1});
  if (projection_ == Projection::spherical) return spherical_ray(pose, fx * per_pixel_x_, fy * per_pixel_y_);
  if (projection_ == Projection::orthographic) return orthographic_ray(pose, x, y);
  if (projection_ == Projection::meters) return meter_ray(fx, fy, lens);
  return lens_ray(pose, x, y, textures_ ? aperture_at(fx * per_pixel_x_, fy * per_pixel_y_) : aperture_,
                  lens);
}

// Returns the radius of the aperture for the film position (u, v): the radius that the sensor gives, times
// the value of the aperture map there (the mean of its channels, clamped to [0, 1]).
float Camera::aperture_at(double u, double v) const {
  const V2 uv(static_cast<float>(std::clamp(u, 0., 1.)), static_cast<float>(std::clamp(v, 0., 1.)));
  return aperture_ * std::clamp(mean_component(textures_->eval(aperture_scale_, uv)), 0.f, 1.f);
}

CameraRay Camera::lens_ray(const Pose& pose, double x, double y, float aperture, V2 lens) const {
  if (!(aperture > 0)) return perspective_ray(pose, pose.origin, {x, y, 1});
  LS_COUNT(lens);
  const V2 p = concentric_disk(lens) * aperture;
  // All rays of a film position go through the same point of the focal plane, which does not depend on the
  // lens sample.
  return perspective_ray(pose, pose.origin + pose.lens_x * p.x + pose.lens_y * p.y,
                         {x * focus_ - p.x, y * focus_ - p.y, focus_});
}

CameraRay Camera::perspective_ray(const Pose& pose, const V3& o, const V3d& local) const {
  const V3d along = pose.axis_x * local.x + pose.axis_y * local.y + pose.axis_z * local.z;
  const double length = along.length();
  const V3 d(along * (1 / length));
  // Clip distances are measured along the camera's axis. The ray starts at the near plane.
  const auto per_depth = static_cast<float>(length / local.z);
  return {o + d * (near_ * per_depth), d, (far_ - near_) * per_depth};
}

std::pair<V3d, V3d> Camera::before_near_plane(double pixels) const {
  V3d low(std::numeric_limits<double>::infinity()), high = -low;
  for (const double x : {-pixels, 1 / per_pixel_x_ + pixels})
    for (const double y : {-pixels, 1 / per_pixel_y_ + pixels}) {
      const CameraRay r = ray(x, y, {.5f, .5f});  // from the middle of the lens
      const V3d end(r.o), lens = end - V3d(r.d) * (double{near_distance(r)} * (1 + 1e-3));
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min({low[k], end[k], lens[k]});
        high[k] = std::max({high[k], end[k], lens[k]});
      }
    }
  // The lens is a disk, and what rays pass up to the near plane is at most (1 + near / focus) times as wide.
  const double wide = has_lens() ? double{aperture_} * spread_ : 0;
  for (int k = 0; k < 3; ++k) {
    const double margin = 1e-6 * std::max(std::abs(low[k]), std::abs(high[k])) +
                          wide * double{std::abs(pose_.lens_x[k]) + std::abs(pose_.lens_y[k])};
    low[k] -= margin;
    high[k] += margin;
  }
  return {low, high};
}

float Camera::near_distance(const Pose& pose, const V3& d) const {
  if (projection_ == Projection::spherical || projection_ == Projection::meters) return 0;
  const double along = pose.axis_z.length();
  if (projection_ == Projection::orthographic) return static_cast<float>(near_ * along);
  return static_cast<float>(near_ * along / pose.axis_z.dot(V3d(d)));
}

// As in Mitsuba, the near plane is mapped by to_world, which may also scale its distance. The ray starts on
// that plane and has the length far - near.
CameraRay Camera::orthographic_ray(const Pose& pose, double x, double y) const {
  const V3d at = V3d(pose.lens_x) * x + V3d(pose.lens_y) * y;
  return {V3(V3d(pose.origin) + at + pose.axis_z * near_), V3(pose.axis_z.normalized()), far_ - near_};
}

// All rays start at the camera's position. u is the azimuth divided by a full turn, from -z towards +x; v is
// the angle from +y divided by half a turn.
CameraRay Camera::spherical_ray(const Pose& pose, double u, double v) const {
  const double phi = u * 2 * kPiD, theta = v * kPiD;
  const double x = std::sin(phi) * std::sin(theta), y = std::cos(theta), z = -std::cos(phi) * std::sin(theta);
  return {pose.origin, V3((pose.axis_x * x + pose.axis_y * y + pose.axis_z * z).normalized()),
          std::numeric_limits<float>::infinity()};
}

[[gnu::cold, gnu::noinline]] CameraRay Camera::meter_ray(double fx, double fy, V2 lens) const {
  const double x = std::floor(fx), y = std::floor(fy);
  const MeterStart& start = meters_->at(static_cast<int>(x), static_cast<int>(y));
  const Meters::Point from =
      meters_->point(start, *world_, {static_cast<float>(fx - x), static_cast<float>(fy - y)}, lens);
  return {from.p, start.has_plate() ? -from.d : from.d, std::numeric_limits<float>::infinity(), 0, &start};
}

PixelFilter::PixelFilter(const ReconstructionFilter& filter) {
  std::visit(
      overloaded{[&](const BoxFilter& f) { radius_ = f.radius; },
                 [&](const TentFilter& f) {
                   kind_ = Kind::tent;
                   radius_ = f.radius;
                 },
                 [&](const GaussianFilter& f) {
                   kind_ = Kind::table;
                   radius_ = 4 * f.stddev;
                   // With steps of radius / 512 the error of linear interpolation in the CDF is below 4e-6.
                   constexpr int kSteps = 1024;
                   const double a = -1 / (2 * f.stddev * f.stddev), edge = std::exp(a * radius_ * radius_);
                   const auto value = [&](double x) { return std::max(0., std::exp(a * x * x) - edge); };
                   cdf_.assign(kSteps + 1, 0);
                   for (int i = 0; i < kSteps; ++i) {
                     const double x0 = radius_ * (2. * i / kSteps - 1), h = 2 * radius_ / kSteps;
                     cdf_[i + 1] = cdf_[i] + h / 6 * (value(x0) + 4 * value(x0 + h / 2) + value(x0 + h));
                   }
                   for (double& c : cdf_) c /= cdf_.back();
                 }},
      filter);
}

double PixelFilter::offset(float u) const {
  switch (kind_) {
    case Kind::box:
      return radius_ * (2. * u - 1);
    case Kind::tent: {
      const double v = 2. * u;
      return radius_ * (v < 1 ? std::sqrt(v) - 1 : 1 - std::sqrt(2 - v));
    }
    case Kind::table:
      break;
  }
  const auto it = std::upper_bound(cdf_.begin() + 1, cdf_.end() - 1, static_cast<double>(u));
  const auto i = static_cast<double>(it - cdf_.begin() - 1);
  const double width = *it - *(it - 1);
  const double f = width > 0 ? (u - *(it - 1)) / width : .5;
  return radius_ * (2 * (i + f) / static_cast<double>(cdf_.size() - 1) - 1);
}

}  // namespace ls::render
