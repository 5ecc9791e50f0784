// The shapes of a world: triangles, spheres, disks and cylinders in world space (recentred, scaled by a power
// of two to unit size), and ray hits on them. Normals point as the scene's file format defines, flips
// included; they point away from the medium `interior`. A group is a set of shapes that is placed in the
// world by instances. Its shapes are in the group's own space, also scaled to unit size; each instance maps
// that space to the world.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/base/asset_loader.h"
#include "worker/render/base/ray_kind.h"
#include "worker/render/geometry/instances.h"
#include "worker/render/math/math.h"
#include "worker/render/math/transform.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

// Properties of a surface. Each shape of the scene is one surface.
struct SurfaceInfo {
  BsdfIndex bsdf;
  std::uint32_t light = kNone;                       // index into Lights; kNone if the surface emits no light
  std::uint32_t interior = kNone, exterior = kNone;  // indices of media; kNone if the scene names none
  bool transition = false;                           // true if the media on its two sides differ
  // True if a ray that crosses the surface may enter another medium: the media on its two sides differ, or it
  // coincides with other surfaces (coincident_reach > 0), which may bound media of their own
  bool borders = false;
  // True for most surfaces: the surface neither emits light nor lets light pass straight through
  bool plain = false;
  bool crossed = false;  // true if some light gets to the other side of the surface
  // True if the surface is not closed: it has an edge, or it encloses a volume only together with other
  // surfaces.
  bool sheet = false;
  bool null = false;      // index-matched: rays pass straight through
  RayKinds hidden;        // rays of these kinds pass straight through the surface
  bool passable = false;  // true if the surface is null or hidden from rays of some kind
  bool holdout = false;   // camera rays that do not pass the surface end there without light
  bool catcher = false;   // true for some holdouts: shadows on the surface are seen (AOV shadow_catcher)
  // True if part of the light passes straight through (BsdfTable::null_transmission)
  bool null_transmission = false;
  // For meshes: `normals` is true if the vertices have normals, `uvs` if they have uvs.
  bool normals = false, uvs = false;
  // wants_uv: true if the material or the light of the surface reads uv, or if the surface is a mesh with uvs
  // and the AOV `uv` reads them; otherwise the uv of hits is not set on meshes and spheres. wants_tangent:
  // true if the material depends on a direction along the surface (anisotropy); otherwise hits have an
  // arbitrary shading frame.
  bool wants_uv = true, wants_tangent = true;
  bool wants_slopes = false;      // true if hits have dp/du and dp/dv (bump maps); implies wants_tangent
  bool wants_attributes = false;  // true if hits have a FacePoint (mesh_attribute textures)
  // True if the material has a lobe that is not a delta, so that next-event estimation is used
  bool smooth = true;
  // True if f_cos and the sampling density depend on directions only by |cos wi| and by the sides of the
  // surface on which wo and wi are (BsdfTable::is_diffuse)
  bool diffuse = false;
  // -1 if normals are opposite to the mesh's winding or to the shape's outward side, else 1
  float orientation = 1;
  // The surface may coincide with others in some places. If it or one of these others is index-matched
  // (`null`), or if they are hidden from different rays, this is at least the largest reach (see
  // SurfaceHit::reach) of all of them, so that one step moves a ray past all of them. 0: find_coincident()
  // has found no such surfaces.
  float coincident_reach = 0;
  // For triangles: the reach (see SurfaceHit::reach) of every hit, if the reaches of all triangles of the
  // surface are within a factor of 16; 0 if each triangle has its own. For other shapes: a lower bound for
  // the reach of a hit.
  float reach = 0;
  // For triangles: if all three barycentric coordinates of a hit are above this value, the hit is far enough
  // from all edges and need not be moved away from them (keep_from_edges)
  double edge = 0;
};

struct Sphere {
  V3d center;
  double radius = 1;
  std::uint32_t surface = 0;
  // Row by row, the rotation from the world to the sphere's own axes, used for uv
  double to_local[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};
struct Disk {  // points center + a u + b v with a^2 + b^2 <= 1
  V3d center, u, v, n;
  std::uint32_t surface = 0;
};
struct Cylinder {      // points p0 + z length axis + (u cos a + v sin a) radius, z in [0, 1]; no caps
  V3d p0, u, v, axis;  // unit vectors u, v, axis, possibly left-handed; normals point away from the axis
  double radius = 1, length = 1;
  std::uint32_t surface = 0;
};

// The index range of the primitives of one kind in one PrimitiveSet. The primitives in [first, passing) are
// opaque; those in [passing, last) let light pass straight through.
struct PrimitiveRange {
  std::uint32_t first = 0, passing = 0, last = 0;
  std::uint32_t count() const { return last - first; }
};
// The primitives of one space: the world's own, or a group's.
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

// Identifies a primitive, as the BVH returns it.
struct PrimitiveId {
  enum class Kind : std::uint32_t { triangle, sphere, disk, cylinder } kind = Kind::triangle;
  std::uint32_t index = 0;
  std::uint32_t instance = kNone;  // index into Geometry::instances, if the primitive is in a group
  bool operator==(const PrimitiveId&) const = default;
};

struct SurfaceHit {
  float t = 0;
  V3 p;   // point on the surface, computed from the shape's data (such as barycentrics), not as o + t d
  V3 ng;  // geometric normal, unit
  Frame shading;
  // True if `shading` has the normal ng because the interpolated normal would face away from the ray
  bool normal_replaced = false;
  V2 uv;
  V3 du{1, 0, 0}, dv{0, 1, 0};  // dp/du and dp/dv in the frame `shading` (UvPoint)
  std::uint32_t surface = 0;
  PrimitiveId primitive;
  // The largest coordinate that was used to compute the hit. Perpendicular to the surface, the position p and
  // the distances that the BVH finds are accurate to a few ulps of `reach` (see offset_point).
  float reach = 1;
  FacePoint face;  // set if SurfaceInfo::wants_attributes

  UvPoint uv_point() const { return {uv, du, dv, &face}; }
  // Sets du and dv from the derivatives dp/du and dp/dv in world space; `scale` is Geometry::scale.
  void set_slopes(const V3& dpdu, const V3& dpdv, double scale) {
    const auto k = static_cast<float>(1 / scale);
    du = shading.to_local(dpdu) * k;
    dv = shading.to_local(dpdv) * k;
  }
};

class Moment;

class Geometry {
 public:
  // Reads the scene's shapes. Fails on files and transforms from which no surface can be made.
  static Result<Geometry> build(const Scene& scene, const AssetLoader& files);

  // In each of the lists below the primitives are sorted. The first are those of the world itself, followed
  // by those of each group, in the order of the groups. Within each of these sets the opaque primitives
  // precede those that let light pass straight through.
  std::vector<V3> positions;
  std::vector<V3> normals;             // parallel to positions if any surface has normals, else empty
  std::vector<V2> uvs;                 // parallel to positions if any surface has uvs, else empty
  std::vector<std::uint32_t> indices;  // 3 per triangle
  std::vector<std::uint32_t> triangle_surface;
  std::vector<Sphere> spheres;
  std::vector<Disk> disks;
  std::vector<Cylinder> cylinders;
  PrimitiveSet own;                  // primitives outside of groups
  std::vector<PrimitiveSet> groups;  // groups, which are visible through instances only
  // The instances of the scene, followed by those of the shapes that move by themselves, in the order of the
  // shapes. The groups of these shapes follow those of the scene.
  std::vector<PlacedInstance> instances;
  std::vector<MovingInstance> moving;  // those of the instances that move
  // For each surface: the instance of a shape that moves by itself, else kNone
  std::vector<std::uint32_t> instance_of_shape;
  std::vector<SurfaceInfo> surfaces;
  SurfaceAttributes attributes;  // mesh attributes that textures read

  V3d center{0, 0, 0};  // world = (scene - center) * scale
  double scale = 1;     // a power of two
  // Radius of a sphere about the world's origin that encloses every shape
  float radius = 1;
  std::uint64_t dropped_triangles = 0;  // number of triangles without area, which are left out
  std::uint64_t wrong_uv_faces = 0;     // see MeshData

  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(triangle_surface.size()); }
  std::uint64_t primitive_count() const {
    return triangle_surface.size() + spheres.size() + disks.size() + cylinders.size();
  }
  std::uint64_t bytes() const;

  V3 vertex(std::uint32_t triangle, int k) const { return positions[indices[3 * triangle + k]]; }
  // Computes the hit of the ray o + t d on the primitive `id` (t, position, normals, uv) from the shape's own
  // data in plain arithmetic. Returns false if the ray misses the primitive according to this computation.
  // Instances that move are where they are at time 0 of the exposure or, with `moment`, at its time.
  bool complete(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
  bool complete(PrimitiveId id, const V3& o, const V3& d, const Moment& moment, SurfaceHit& hit) const;
  // Returns the largest absolute coordinate of the triangle's corners.
  float reach_of(std::uint32_t triangle) const;

 private:
  [[gnu::noinline]] bool complete_unusual(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const;
  bool complete_local(PrimitiveId id, const V3d& o, const V3d& d, SurfaceHit& hit) const;
  bool complete_instanced(const PlacedInstance& i, PrimitiveId id, const V3& o, const V3& d,
                          SurfaceHit& hit) const;
};

// Returns where an instance is at a time of the exposure, from 0 to 1.
PlacedInstance placed_at(const Geometry& geometry, std::uint32_t instance, double time);

// The functions intersect() return the first t in (t_min, t_max) at which the ray o + t d hits the shape, or
// infinity if there is none. The BVH's callbacks for shapes call them, too.
double intersect(const Sphere& s, const V3d& o, const V3d& d, double t_min, double t_max);
double intersect(const Disk& s, const V3d& o, const V3d& d, double t_min, double t_max);
double intersect(const Cylinder& s, const V3d& o, const V3d& d, double t_min, double t_max);

// Returns the uv of the point in the direction n, a unit vector, from the sphere's centre. u is the azimuth
// and v the polar angle, each divided by its range.
V2 sphere_uv(const Sphere& s, const V3d& n);

inline float largest(const V3& v) { return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z))); }

// Moves the point p on a surface of geometric normal ng off the surface, to the side that `w` points to, by
// 16 ulps, where an ulp is 2^-24 of the reach. Rounding moves p off the surface by at most sqrt(3) ulps.
// The BVH subtracts the ray's origin from a triangle's corners and finds the distance of the triangle's plane
// by products of these differences. Each difference of two coordinates is at most twice the reach and
// accurate to half an ulp of its value, and so are the six products and sums that follow; all errors together
// are below 8 ulps. So 16 ulps leave a safety factor of two.
inline V3 offset_point(const V3& p, const V3& ng, float reach, const V3& w) {
  return p + ng * std::copysign(reach * 0x1p-20f, dot(ng, w));
}
inline V3 offset_point(const SurfaceHit& hit, const V3& w) {
  return offset_point(hit.p, hit.ng, hit.reach, w);
}
// Like offset_point(), moves p off the surface, for a ray from x that ends at p. The BVH then subtracts
// coordinates of x, which may be far larger than those of the surface, so they count like the reach.
inline V3 offset_target(const V3& p, const V3& ng, float reach, const V3& x, const V3& w) {
  return offset_point(p, ng, std::max(reach, largest(x)), w);
}
inline V3 offset_target(const SurfaceHit& hit, const V3& x, const V3& w) {
  return offset_target(hit.p, hit.ng, hit.reach, x, w);
}
// Returns SurfaceHit::reach, the magnitude that bounds the rounding error of p, for a shape that is
// intersected in double precision. p is rounded to float32, so its largest coordinate counts in full. `size`,
// the largest distance of p from the shape's reference point, counts times 2^-28: an ulp of double is 2^-29
// of one of float32, and there is a safety factor of 2.
inline float reach_in_double(const V3& p, double size) {
  return std::max(largest(p), static_cast<float>(size * 0x1p-28));
}

}  // namespace ls::render
