// The shapes of a world: triangles, spheres and disks in world space (recentred, scaled by a power of two to
// unit size), and what a ray finds on them. Normals point as the dialect says, flips included; `interior` is
// the side they point away from.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/asset_loader.h"
#include "worker/render/math.h"

namespace ls::render {

inline constexpr std::uint32_t kNone = 0xffffffffu;

struct SurfaceInfo {  // one per scene shape
  BsdfIndex bsdf;
  std::uint32_t light = kNone;                       // index into Lights
  std::uint32_t interior = kNone, exterior = kNone;  // media
  bool transition = false;                           // crossing it changes the medium
  bool null = false;                                 // index-matched: rays pass
  bool veil = false;                                 // a share of the light passes (BsdfTable::veil)
  bool normals = false, uvs = false;                 // triangles: per-vertex data
  // Whether anything on it reads uv, or a direction along it (anisotropy): else hits carry (0, 0) and any
  // frame.
  bool wants_uv = true, wants_tangent = true;
  bool smooth = true;     // of its material: next-event estimation makes sense
  float orientation = 1;  // -1: normals are flipped against winding or the outward direction
};

struct Sphere {
  V3d center;
  double radius = 1;
  std::uint32_t surface = 0;
  double to_local[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // rotation, for uv
};
struct Disk {  // points center + a u + b v with a^2 + b^2 <= 1
  V3d center, u, v, n;
  std::uint32_t surface = 0;
};

// Which primitive: what the BVH returns and all that is taken from it.
struct PrimitiveId {
  enum class Kind : std::uint32_t { triangle, sphere, disk } kind = Kind::triangle;
  std::uint32_t index = 0;
  bool operator==(const PrimitiveId&) const = default;
};

struct SurfaceHit {
  float t = 0;
  V3 p;   // on the surface: from barycentrics or the sphere's centre, not from o + t d
  V3 ng;  // geometric normal, unit
  Frame shading;
  V2 uv;
  std::uint32_t surface = 0;
  PrimitiveId primitive;
};

class Geometry {
 public:
  // Reads the scene's shapes. Fails on files and transforms that no surface can be made of.
  static Result<Geometry> build(const Scene& scene, const AssetLoader& files);

  // Triangles, spheres and disks are sorted: first the opaque ones, then those that light passes.
  std::vector<V3> positions;
  std::vector<V3> normals;             // parallel to positions if any surface has normals, else empty
  std::vector<V2> uvs;                 // likewise
  std::vector<std::uint32_t> indices;  // 3 a triangle
  std::vector<std::uint32_t> triangle_surface;
  std::uint32_t opaque_triangles = 0;
  std::vector<Sphere> spheres;
  std::uint32_t opaque_spheres = 0;
  std::vector<Disk> disks;
  std::uint32_t opaque_disks = 0;
  std::vector<SurfaceInfo> surfaces;

  V3d center{0, 0, 0};                  // world = (scene - center) * scale
  double scale = 1;                     // a power of two
  float radius = 1;                     // of a sphere about the world's origin that holds every shape
  std::uint64_t dropped_triangles = 0;  // without area

  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(triangle_surface.size()); }
  std::uint64_t bytes() const;

  V3 vertex(std::uint32_t triangle, int k) const { return positions[indices[3 * triangle + k]]; }
  // Completes a hit on this primitive: t, position, normals, uv, from exact data and plain arithmetic.
  // Nothing if the ray does not meet it after all.
  bool complete(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
};

// Distance along the ray to the sphere or disk within (t_min, t_max), or infinity. For the BVH's callbacks
// too.
double intersect(const Sphere& s, const V3d& o, const V3d& d, double t_min, double t_max);
double intersect(const Disk& s, const V3d& o, const V3d& d, double t_min, double t_max);

// Azimuth and polar angle, each over its range, of a unit direction from the sphere's centre.
V2 sphere_uv(const Sphere& s, const V3d& n);

// Moves a point off the surface to the side that `w` leaves to. In the unit-size world positions are good to
// a few units in the last place of 1 (6e-8), and so are the BVH's distances perpendicular to a surface: 2^-20
// = 16 of them.
inline V3 offset_point(const V3& p, const V3& ng, const V3& w) {
  const float m = std::max(1.f, std::max(std::abs(p.x), std::max(std::abs(p.y), std::abs(p.z))));
  return p + ng * std::copysign(m * 0x1p-20f, dot(ng, w));
}

}  // namespace ls::render
