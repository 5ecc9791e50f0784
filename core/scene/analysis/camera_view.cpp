#include "core/scene/analysis/camera_view.h"

#include <algorithm>
#include <limits>

#include "core/scene/transform.h"

namespace ls::scene {
namespace {

// Returns the matrix, for row vectors, from the world to the camera's space of Sensor: x to the left.
RowMatrix inverse_of(const Transform& t) {
  const Vec3 x = column(t, 0), y = column(t, 1), z = column(t, 2), origin = column(t, 3);
  const double scale = 1 / determinant3(t);
  // The rows of the inverse of the linear part; as columns, since vectors here are rows.
  const Vec3 rows[3] = {cross(y, z), cross(z, x), cross(x, y)};
  RowMatrix m{};
  m[15] = 1;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t r = 0; r < 3; ++r) m[4 * r + c] = rows[c][r] * scale;
    m[12 + c] = -dot(rows[c], origin) * scale;
  }
  return m;
}

RowMatrix product(const RowMatrix& a, const RowMatrix& b) {
  RowMatrix m{};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t k = 0; k < 4; ++k) m[4 * r + c] += a[4 * r + k] * b[4 * k + c];
  return m;
}

// Returns the matrix from the camera's space (x to the right) to the image. With a perspective, the direction
// (x, y, 1) of that space is at (1 + x / tx) / 2 from the left edge of the frame and at (1 - y / ty) / 2 from
// its upper edge, less the principal point offset (Camera::ray()). The image is from x0 to x0 + width of the
// frame. The depth n f / (f - n) (1 / n - 1 / z) is 0 at the near and 1 at the far plane.
// Parallel rays keep x and y, and the depth is linear.
RowMatrix projection_of(const Sensor& s, const FramePart& part, FrameSize image) {
  const double aspect = static_cast<double>(part.frame.width) / part.frame.height;
  const bool parallel = s.projection == Projection::orthographic;
  const double tx = parallel ? 1 : tan_half_fov_x(s.fov, s.fov_axis, aspect), ty = tx / aspect;
  const double kx = static_cast<double>(part.frame.width) / image.width,
               ky = static_cast<double>(part.frame.height) / image.height;
  const double middle_x =
                   (.5 - s.principal_point_offset[0]) * kx - static_cast<double>(part.x0) / image.width,
               middle_y =
                   (.5 - s.principal_point_offset[1]) * ky - static_cast<double>(part.y0) / image.height;
  // Parallel rays end at this distance in the world, whatever the scale of the camera (Camera::ray()).
  const Vec3 axis = column(s.to_world, 2);
  const double depth = (s.far_clip - s.near_clip) / (parallel ? std::sqrt(dot(axis, axis)) : 1);
  RowMatrix m{};
  m[0] = kx / (2 * tx);
  m[5] = -ky / (2 * ty);
  const std::size_t row = parallel ? 12 : 8;  // the row that is multiplied by 1, or by z = w'
  m[row] = middle_x;
  m[row + 1] = middle_y;
  m[10] = parallel ? 1 / depth : s.far_clip / depth;
  m[14] = parallel ? -s.near_clip / depth : -s.near_clip * (s.far_clip / depth);
  m[parallel ? 15 : 11] = 1;
  return m;
}

bool fits(const RowMatrix& m) {
  return std::ranges::all_of(m, [](double v) { return std::abs(v) <= std::numeric_limits<float>::max(); });
}

}  // namespace

FramePart frame_part(const FilmSettings& film, FrameSize image) {
  if (!film.has_crop()) return {image};
  const double kx = static_cast<double>(image.width) / film.crop_size.width,
               ky = static_cast<double>(image.height) / film.crop_size.height;
  const auto scaled = [](int pixels, double k) { return static_cast<int>(std::lround(pixels * k)); };
  return {{std::max(1, scaled(film.size.width, kx)), std::max(1, scaled(film.size.height, ky))},
          scaled(film.crop_offset[0], kx),
          scaled(film.crop_offset[1], ky)};
}

std::optional<CameraMatrices> camera_matrices(const Sensor& sensor, const FilmSettings& film,
                                              FrameSize image) {
  if (!invertible(sensor.to_world)) return std::nullopt;
  RowMatrix to_camera = inverse_of(sensor.to_world);
  for (std::size_t r = 0; r < 4; ++r) to_camera[4 * r] = 0. - to_camera[4 * r];  // to the right; 0, not -0
  if (!fits(to_camera)) return std::nullopt;
  CameraMatrices out{to_camera, std::nullopt};
  if (sensor.projection == Projection::spherical) return out;
  const RowMatrix to_image = product(to_camera, projection_of(sensor, frame_part(film, image), image));
  if (fits(to_image)) out.world_to_ndc = to_image;
  return out;
}

}  // namespace ls::scene
