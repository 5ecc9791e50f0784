// The shapes of a world: triangles, spheres, disks and cylinders in world space (recentred, scaled by a power
// of two to unit size), and ray hits on them. Normals point as the dialect defines, flips included;
// `interior` is the side they point away from. The shapes of a group lie in the group's own space, also
// scaled to unit size; its instances map that to the world.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/math/math.h"
#include "worker/render/math/transform.h"
#include "worker/render/texture/surface_attributes.h"
#include "worker/render/texture/uv_point.h"

namespace ls::render {

inline constexpr std::uint32_t kNone = 0xffffffffu;

struct SurfaceInfo {  // one per scene shape
  BsdfIndex bsdf;
  std::uint32_t light = kNone;                       // index into Lights
  std::uint32_t interior = kNone, exterior = kNone;  // media
  bool transition = false;                           // the medium changes across it
  bool borders = false;                              // `transition`, or coincides with a surface that has one
  bool plain = false;                                // neither emits nor lets light pass, as most surfaces
  bool crossed = false;                              // some light reaches its other side
  bool sheet = false;              // not closed: has an edge, or bounds a body together with others
  bool null = false;               // index-matched: rays pass straight through
  bool null_transmission = false;  // part of the light passes straight through (BsdfTable::null_transmission)
  bool normals = false, uvs = false;  // triangles: per-vertex data
  // True if something on it reads uv, or a direction along it (anisotropy). Otherwise hits have uv = (0, 0)
  // and an arbitrary frame.
  bool wants_uv = true, wants_tangent = true;
  bool wants_slopes = false;      // hits have dp/du and dp/dv (bump maps); implies wants_tangent
  bool wants_attributes = false;  // hits have a FacePoint (mesh_attribute textures)
  bool smooth = true;             // the material has a lobe that is not a delta: use next-event estimation
  float orientation = 1;          // -1: normals are flipped against winding or outward direction
  // For surfaces that coincide with others somewhere, one of them null: the largest reach of all of these
  // (see SurfaceHit::reach), so that a ray steps over all of them at once. 0: none coincides.
  float coincident_reach = 0;
  // Reach of hits on a triangle, if the reaches of all triangles are within a factor of 16; 0: each has its
  // own. For other shapes the smallest reach.
  float reach = 0;
  double edge = 0;  // hits whose barycentric coordinates all exceed this are clear of all edges
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
struct Cylinder {      // points p0 + z length + (u cos a + v sin a) radius, z in [0, 1]; no caps
  V3d p0, u, v, axis;  // unit vectors; u, v, axis may be left-handed: normals point away from the axis
  double radius = 1, length = 1;
  std::uint32_t surface = 0;
};

// Index range of the primitives of one kind in one set: [first, passing) are opaque, [passing, last) let
// light pass.
struct PrimitiveRange {
  std::uint32_t first = 0, passing = 0, last = 0;
  std::uint32_t count() const { return last - first; }
};
// The primitives of one space: the world's own, or those of a group.
struct PrimitiveSet {
  PrimitiveRange triangles, spheres, disks, cylinders;
  std::uint32_t count() const {
    return triangles.count() + spheres.count() + disks.count() + cylinders.count();
  }
  bool any_opaque() const {
    return triangles.passing > triangles.first || spheres.passing > spheres.first ||
           disks.passing > disks.first || cylinders.passing > cylinders.first;
  }
  bool any_passing() const {
    return triangles.last > triangles.passing || spheres.last > spheres.passing ||
           disks.last > disks.passing || cylinders.last > cylinders.passing;
  }
};
struct PlacedInstance {
  std::uint32_t group = 0;
  float mirrored = 1;         // -1: the map reverses orientations
  Affine to_world, to_local;  // between the world's space and the group's
};

// Identifies a primitive, as the BVH returns it.
struct PrimitiveId {
  enum class Kind : std::uint32_t { triangle, sphere, disk, cylinder } kind = Kind::triangle;
  std::uint32_t index = 0;
  std::uint32_t instance = kNone;  // of Geometry::instances, if the primitive is in a group
  bool operator==(const PrimitiveId&) const = default;
};

struct SurfaceHit {
  float t = 0;
  V3 p;   // on the surface: computed from barycentrics or the sphere's centre, not as o + t d
  V3 ng;  // geometric normal, unit
  Frame shading;
  V2 uv;
  V3 du{1, 0, 0}, dv{0, 1, 0};  // see UvPoint
  std::uint32_t surface = 0;
  PrimitiveId primitive;
  // The largest coordinate used in computing the hit: p, and the distances that the BVH finds across the
  // surface, are accurate to a few ulps of it (see offset_point).
  float reach = 1;
  FacePoint face;  // set if SurfaceInfo::wants_attributes

  UvPoint uv_point() const { return {uv, du, dv, &face}; }
  // Sets du and dv from dp/du and dp/dv in the world; `scale` is the geometry's.
  void set_slopes(const V3& dpdu, const V3& dpdv, double scale) {
    const auto k = static_cast<float>(1 / scale);
    du = shading.to_local(dpdu) * k;
    dv = shading.to_local(dpdv) * k;
  }
};

class Geometry {
 public:
  // Reads the scene's shapes. Fails on files and transforms from which no surface can be made.
  static Result<Geometry> build(const Scene& scene, const AssetLoader& files);

  // Primitives are sorted: the world's own before those of the groups, in the groups' order; within each set
  // opaque ones before those that let light pass.
  std::vector<V3> positions;
  std::vector<V3> normals;             // parallel to positions if any surface has normals, else empty
  std::vector<V2> uvs;                 // parallel to positions if any surface has uvs, else empty
  std::vector<std::uint32_t> indices;  // 3 per triangle
  std::vector<std::uint32_t> triangle_surface;
  std::vector<Sphere> spheres;
  std::vector<Disk> disks;
  std::vector<Cylinder> cylinders;
  PrimitiveSet own;                  // primitives outside of groups
  std::vector<PrimitiveSet> groups;  // visible through instances only
  std::vector<PlacedInstance> instances;
  std::vector<SurfaceInfo> surfaces;
  SurfaceAttributes attributes;  // mesh attributes that textures read

  V3d center{0, 0, 0};                  // world = (scene - center) * scale
  double scale = 1;                     // a power of two
  float radius = 1;                     // of a sphere about the world's origin that encloses every shape
  std::uint64_t dropped_triangles = 0;  // zero-area triangles

  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(triangle_surface.size()); }
  std::uint64_t primitive_count() const {
    return triangle_surface.size() + spheres.size() + disks.size() + cylinders.size();
  }
  std::uint64_t bytes() const;

  V3 vertex(std::uint32_t triangle, int k) const { return positions[indices[3 * triangle + k]]; }
  // Completes a hit on this primitive: t, position, normals, uv, from exact data and plain arithmetic. False
  // if the ray does not meet it after all.
  bool complete(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
  // The largest coordinate of the triangle's corners.
  float reach_of(std::uint32_t triangle) const;

 private:
  [[gnu::noinline]] bool complete_unusual(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
  bool complete_local(PrimitiveId id, const V3d& o, const V3d& d, SurfaceHit& hit) const;
  bool complete_instanced(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
};

// Distance along the ray to the shape within (t_min, t_max), or infinity. Also used by the BVH callbacks.
double intersect(const Sphere& s, const V3d& o, const V3d& d, double t_min, double t_max);
double intersect(const Disk& s, const V3d& o, const V3d& d, double t_min, double t_max);
double intersect(const Cylinder& s, const V3d& o, const V3d& d, double t_min, double t_max);

// uv from the azimuth and polar angle, each normalised to its range, of a unit direction from the sphere's
// centre.
V2 sphere_uv(const Sphere& s, const V3d& n);

inline float largest(const V3& v) { return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z))); }

// Moves a point off the surface to the side of `w`, by 16 ulps of the reach. Rounding takes p at most one ulp
// off the surface (sqrt(3) / 2). The BVH takes a triangle's corners relative to the ray's origin and finds
// the distance of its plane by products of these: each component is accurate to half an ulp of the difference
// of two coordinates, at most twice the reach, and so are the six rounded products and sums: together below 8
// ulps. That leaves a safety factor of two.
inline V3 offset_point(const V3& p, const V3& ng, float reach, const V3& w) {
  return p + ng * std::copysign(reach * 0x1p-20f, dot(ng, w));
}
inline V3 offset_point(const SurfaceHit& hit, const V3& w) {
  return offset_point(hit.p, hit.ng, hit.reach, w);
}
// Reach for shapes intersected in double precision, where p lies up to `size` from the shape's reference
// point: p is rounded to float32, and 2^-28 turns 16 ulps of float32 into 16 ulps of double, times 2.
inline float reach_in_double(const V3& p, double size) {
  return std::max(largest(p), static_cast<float>(size * 0x1p-28));
}

}  // namespace ls::render
