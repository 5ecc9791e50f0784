// Shapes, camera and film of a scene; see scene.h.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/image/frame/frame.h"
#include "core/scene/scene_values.h"

namespace ls {

struct RectangleShape {  // [-1,1]^2 in z = 0, normal +z, uv = (x+1)/2, (y+1)/2
  bool operator==(const RectangleShape&) const = default;
};
struct CubeShape {  // [-1,1]^3, normals outwards; each face has its own uv from 0 to 1
  bool operator==(const CubeShape&) const = default;
};
struct SphereShape {  // Shape::to_world transforms the sphere of this center and radius
  Vec3 center{0, 0, 0};
  double radius = 1;
  bool operator==(const SphereShape&) const = default;
};
struct DiskShape {  // unit disk in z = 0, normal +z
  bool operator==(const DiskShape&) const = default;
};
// A cylinder without caps about the line from p0 to p1. Its normals point outwards, even if to_world
// mirrors it.
struct CylinderShape {
  Vec3 p0{0, 0, 0}, p1{0, 0, 1};
  double radius = 1;
  bool operator==(const CylinderShape&) const = default;
};
enum class MeshFormat { obj, ply, serialized };
struct MeshShape {
  AssetIndex file;
  MeshFormat format = MeshFormat::obj;
  bool face_normals = false;
  // Only for files without vertex normals. true: faces are shaded flat; false: smooth normals are computed.
  bool flat_without_normals = false;
  bool flip_tex_coords = false;
  int shape_index = 0;  // index of the mesh in a `serialized` file
  bool operator==(const MeshShape&) const = default;
};
using Geometry = std::variant<RectangleShape, CubeShape, SphereShape, DiskShape, MeshShape, CylinderShape>;

// The lists of link sets (core/base/light/link_names.h) to which a light is linked. Only the shapes and media
// in `receivers` receive its light. Only the shapes in `blockers` stop or attenuate its light on the way. An
// empty text is the list of everything.
struct LightLinks {
  std::string receivers, blockers;
  bool operator==(const LightLinks&) const = default;
};

// Light from a shape's surface, emitted on the side of the normal or, if two_sided, on both sides. If
// beam_width is set, the light is a beam: at an angle a from the normal, in degrees, it has the full radiance
// for a within beam_width and zero beyond cutoff_angle; in between it is the full radiance times s^falloff
// with s = (cos a - cos cutoff_angle) / (cos beam_width - cos cutoff_angle).
struct AreaEmitter {
  TextureIndex radiance;
  double cutoff_angle = 90, beam_width = 90, falloff = 1;
  bool two_sided = false;
  std::string light_group;  // as of the emitters without a shape (scene.h)
  LightLinks links;
  bool operator==(const AreaEmitter&) const = default;
};

// Where something that moves is at one time of the exposure, from 0 (the shutter opens) to 1 (it closes).
// core/scene/motion.h says what is between two keys.
struct MotionKey {
  double time = 0;
  Transform to_world;
  bool operator==(const MotionKey&) const = default;
};

struct Shape {
  Geometry geometry;
  Transform to_world;  // where the shape is; if it moves: in the middle of the exposure
  // Where the shape is during the exposure, as Sensor::motion; empty if it does not move. Shapes that are in
  // a group or have a meter do not move, and those that emit light move without being stretched.
  std::vector<MotionKey> motion;
  bool flip_normals = false;
  BsdfIndex bsdf;
  std::optional<AreaEmitter> emitter;
  // The media on the two sides of the surface. Its normal points away from the interior, into the exterior.
  std::optional<MediumIndex> interior, exterior;
  bool is_medium_transition = false;  // true if the file gives an interior or exterior
  // If set, the shape belongs to this group: it is visible only as part of the group's instances, and
  // to_world places it within the group. It does not emit light. In the scene's list of shapes, the shapes of
  // a group are contiguous, and those of a group of lower index come first.
  std::optional<GroupIndex> group;
  // Camera rays, up to the first scattering, pass straight through a shape that is not visible_camera. All
  // other rays meet it.
  bool visible_camera = true;
  // A camera ray that meets the shape and does not pass it ends there without light. The shape has no opacity
  // in the AOVs of opacity, but hides what is behind.
  bool holdout = false;
  // With a transparent film, the camera sees of the shape only the shadows that other shapes and media cast
  // on it: it is black, and its opacity is the share of direct light that is missing. All other rays meet it
  // as ever.
  bool shadow_catcher = false;
  // Other rays that pass straight through the shape if the flag is false. visible_shadow: rays from a vertex
  // to a lamp, so that the shape casts no shadow in direct light. visible_reflection: rays that a surface
  // scattered (reflected or refracted). visible_volume: rays that a medium scattered. If the shape emits
  // light, vertices on surfaces (visible_reflection) or in media (visible_volume) receive none of it.
  bool visible_shadow = true, visible_reflection = true, visible_volume = true;
  // The names of the link sets that the shape is in (LightLinks), separated by commas.
  std::string link_sets;
  std::optional<MeterIndex> meter;  // a meter measures the light that reaches the shape
  bool operator==(const Shape&) const = default;
};
struct ShapeGroup {  // a group of shapes, which refer to it by its index
  bool operator==(const ShapeGroup&) const = default;
};
struct Instance {  // a copy of a group's shapes, placed in the world
  GroupIndex group;
  Transform to_world;             // where it is; if it moves: in the middle of the exposure
  std::vector<MotionKey> motion;  // as Shape::motion
  bool operator==(const Instance&) const = default;
};

enum class FovAxis { x, y, diagonal, smaller, larger };

// How the camera projects. orthographic: parallel rays from the rectangle [-1, 1] x [-1/a, 1/a] in the
// camera's x and y, where a is width / height of the image; to_world may scale this rectangle. spherical: all
// directions by latitude and longitude, as in Mitsuba 0.x: the top row is +y; on the horizon the left edge is
// -z, and a quarter of the width further is +x. A spherical camera ignores near_clip and far_clip.
// meters: there is no camera. The scene has meters, and each block of pixels of the frame measures one number
// (core/image/frame/meter_blocks.h).
enum class Projection { perspective, orthographic, spherical, meters };
struct Sensor {        // looks along the +z axis of to_world, with +y up and +x to the LEFT, as in Mitsuba
  Transform to_world;  // where the camera is; if it moves: in the middle of the exposure
  // Where the camera is during the exposure, sorted by time: the first key is at 0 and the last at 1. A
  // camera that does not move has no keys. In a scene in which something moves, the shutter is open from 0
  // to 1; in others it opens and closes at 0.
  std::vector<MotionKey> motion;
  double shutter_open = 0, shutter_close = 0;
  double fov = 50;  // in degrees, along fov_axis
  FovAxis fov_axis = FovAxis::x;
  double near_clip = 1e-2, far_clip = 1e4;
  std::array<double, 2> principal_point_offset{0, 0};
  double aperture_radius = 0;  // 0: pinhole camera
  double focus_distance = 1;
  std::optional<MediumIndex> medium;  // the medium around the camera
  Projection projection = Projection::perspective;
  // An image that is stretched over the frame, with (u, v) = (0, 0) in the upper left corner. Its value at a
  // pixel, from 0 to 1, is a factor on aperture_radius.
  std::optional<TextureIndex> aperture_scale;
  bool operator==(const Sensor&) const = default;
};

// The quantity that a meter measures, per colour channel. radiance: the radiance that arrives along a ray
// that starts at a point. irradiance: the integral of radiance times cosine over the hemisphere of the
// normal, at a point, or the mean over a shape. flux: the irradiance of a shape times its area. fluence: the
// integral of radiance over all directions, at a point.
enum class MeterKind { radiance, irradiance, flux, fluence };
// A point of the scene, and the unit normal of the plane through which irradiance arrives, or the direction
// into which a meter of radiance looks; 0 for fluence.
struct MeterPoint {
  Vec3 position{0, 0, 0}, direction{0, 0, 0};
  bool operator==(const MeterPoint&) const = default;
};
// Measures at each of its points or, if it has none, on the shape that refers to it (Shape::meter).
struct Meter {
  std::string name;
  MeterKind kind = MeterKind::irradiance;
  std::vector<MeterPoint> points;
  // The medium around everything, which no shape bounds. Media that shapes enclose are found by their shapes.
  std::optional<MediumIndex> medium;
  std::size_t count() const { return points.empty() ? 1 : points.size(); }
  bool operator==(const Meter&) const = default;
};

struct BoxFilter {
  double radius = .5;
  bool operator==(const BoxFilter&) const = default;
};
struct TentFilter {
  double radius = 1;
  bool operator==(const TentFilter&) const = default;
};
struct GaussianFilter {  // truncated at 4 stddev and lowered so that it is 0 there, as in Mitsuba
  double stddev = .5;    // in pixels
  bool operator==(const GaussianFilter&) const = default;
};
using ReconstructionFilter = std::variant<BoxFilter, TentFilter, GaussianFilter>;

struct FilmSettings {
  FrameSize size{768, 576};
  ReconstructionFilter filter = GaussianFilter{};
  // The rendered part of the frame, in pixels; if its width is 0, the whole frame is rendered.
  std::array<int, 2> crop_offset{0, 0};
  FrameSize crop_size{0, 0};
  // True: the camera does not see the environment, so that the image can be laid over another one, and the
  // image has the AOV `alpha`.
  bool transparent = false;
  bool has_crop() const { return crop_size.width > 0; }
  FrameSize image_size() const { return has_crop() ? crop_size : size; }  // size of the output image
  bool operator==(const FilmSettings&) const = default;
};

// On a ray through a medium, the integrator `volpath_distant_mis` samples a point and connects it to a light.
// DistanceSampling is the probability density along the ray from which this point is drawn; `mis` draws one
// point from each of the other two densities, and weights the two points by the MisHeuristic.
enum class DistanceSampling { exponential, equiangular, mis };
enum class MisHeuristic { power, balance };

}  // namespace ls
