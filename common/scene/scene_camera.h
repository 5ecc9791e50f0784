// Camera and film of a scene; see scene.h.
#pragma once

#include <array>
#include <optional>
#include <variant>

#include "common/image/frame/frame.h"
#include "common/scene/scene_values.h"

namespace ls {

enum class FovAxis { x, y, diagonal, smaller, larger };

// How the camera projects. orthographic: parallel rays from the rectangle [-1, 1] x [-1/a, 1/a] in the
// camera's x and y (a: width / height of the image), which to_world may scale. spherical: all directions by
// latitude and longitude; the top row is +y, the left edge -z, and a quarter of the width further is +x
// (Mitsuba 0.x); it has no clip planes.
enum class Projection { perspective, orthographic, spherical };
struct Sensor {  // looks along +z of to_world, with +y up and +x to the LEFT (Mitsuba)
  Transform to_world;
  double fov = 50;  // in degrees, along fov_axis
  FovAxis fov_axis = FovAxis::x;
  double near_clip = 1e-2, far_clip = 1e4;
  std::array<double, 2> principal_point_offset{0, 0};
  double aperture_radius = 0;  // 0: pinhole camera
  double focus_distance = 1;
  std::optional<MediumIndex> medium;  // the medium around the camera
  Projection projection = Projection::perspective;
  // image over the frame; its value at a pixel is a factor on the aperture's radius
  std::optional<TextureIndex> aperture_scale;
  bool operator==(const Sensor&) const = default;
};

struct BoxFilter {
  double radius = .5;
  bool operator==(const BoxFilter&) const = default;
};
struct TentFilter {
  double radius = 1;
  bool operator==(const TentFilter&) const = default;
};
struct GaussianFilter {  // truncated at 4 stddev, and shifted to reach 0 there (Mitsuba)
  double stddev = .5;
  bool operator==(const GaussianFilter&) const = default;
};
using ReconstructionFilter = std::variant<BoxFilter, TentFilter, GaussianFilter>;

struct FilmSettings {
  FrameSize size{768, 576};
  ReconstructionFilter filter = GaussianFilter{};
  // The rendered part of the frame, in pixels; if its width is 0, the whole frame is rendered.
  std::array<int, 2> crop_offset{0, 0};
  FrameSize crop_size{0, 0};
  bool has_crop() const { return crop_size.width > 0; }
  FrameSize image_size() const { return has_crop() ? crop_size : size; }  // size of the output image
  bool operator==(const FilmSettings&) const = default;
};

// On a ray through a medium, the integrator `volpath_distant_mis` samples a point and connects it to a light.
// DistanceSampling: the density of this point; `mis` takes one sample of each density, and weights the two by
// the MisHeuristic.
enum class DistanceSampling { exponential, equiangular, mis };
enum class MisHeuristic { power, balance };

}  // namespace ls
