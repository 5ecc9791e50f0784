// Part of accel.cpp: Embree callbacks for spheres, disks and cylinders, and for collecting all primitives
// along a ray.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "worker/render/base/work_counters.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/embree.h"
#include "worker/render/geometry/surface_boxes.h"

namespace ls::render {

// The Embree geometry ids of the primitives: kind + side * kKinds. Side 0 contains the opaque primitives and
// side 1 those that let light pass. The ids are the same in every Embree scene. In the Embree scenes of
// groups (shapes that are placed by instances) kInGroup is added, so that the id of a hit alone shows whether
// the primitive is in a group. In the world's Embree scenes the instances have the ids from kFirstInstance
// on.
enum : unsigned {
  kTriangles = 0,
  kSpheres = 1,
  kDisks = 2,
  kCylinders = 3,
  kKinds = 4,
  kInGroup = 2 * kKinds,
  kFirstInstance = 2 * kKinds
};

// The shapes of one kind, in the form that Embree passes to our callbacks. All primitives except triangles
// are user geometries, which our own double-precision code intersects.
template <class Shape>
struct ShapeSet {
  std::span<const Shape> shapes;
  const PlacedInstance* instances = nullptr;  // Geometry::instances, by instance id - kFirstInstance
};

template <class Shape>
void bounds_callback(const RTCBoundsFunctionArguments* args) {
  const Shape& s = static_cast<const ShapeSet<Shape>*>(args->geometryUserPtr)->shapes[args->primID];
  // The box is enlarged by more than the last digit of its float32 coordinates, so that rounding cannot cut
  // the shape.
  const Box b = box_of(s);
  const V3d margin = (b.hi - b.lo) * .5e-6 + V3d(1e-6);
  const V3 lo(b.lo - margin), hi(b.hi + margin);
  *args->bounds_o = {lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, 0};
}

// The data about the ray that a callback needs: Embree's context, and the ray's origin o and direction d in
// world space. Inside an instance Embree passes to the callback only the ray as transformed, in float32, to
// the group's space.
struct Tracing {
  EmbreeContext context;
  const V3 *o, *d;
  bool collects = false;  // true if this object is a Collecting

  Tracing(const V3& origin, const V3& direction) : o(&origin), d(&direction) { embree_start(context); }

  static Tracing& of(EmbreeContext* context) { return *reinterpret_cast<Tracing*>(context); }
};

template <class Shape>
double shape_distance(const void* user, unsigned prim, EmbreeContext* context, const RTCRay& ray) {
  LS_COUNT(user_geometry);
  const auto& set = *static_cast<const ShapeSet<Shape>*>(user);
  const Shape& s = set.shapes[prim];
  if (context->instID[0] != RTC_INVALID_GEOMETRY_ID) {
    // This is the same computation as in Geometry::complete_instanced, so that both find the same hits.
    const Tracing& tracing = Tracing::of(context);
    const PlacedInstance& i = set.instances[context->instID[0] - kFirstInstance];
    return intersect(s, i.to_local.point(V3d(*tracing.o)), i.to_local.vector(V3d(*tracing.d)), ray.tnear,
                     ray.tfar);
  }
  return intersect(s, V3d(ray.org_x, ray.org_y, ray.org_z), V3d(ray.dir_x, ray.dir_y, ray.dir_z), ray.tnear,
                   ray.tfar);
}

// The state of a trace that collects all hits along the ray. Its filter rejects every hit, so that Embree
// continues.
struct Collecting : Tracing {
  Collecting(const V3& origin, const V3& direction) : Tracing(origin, direction) { collects = true; }
  std::array<RTCHit, CoincidentHits::kMost> met;  // of each hit only the ids are set
  std::size_t count = 0;

  static void keep(EmbreeContext* context, unsigned geometry, unsigned primitive, unsigned instance) {
    auto& c = static_cast<Collecting&>(Tracing::of(context));
    if (c.count < c.met.size())
      c.met[c.count++] = {.primID = primitive, .geomID = geometry, .instID = {instance}};
  }
};
inline void collect_callback(const RTCFilterFunctionNArguments* args) {
  if (!args->valid[0]) return;
  const auto* hit = reinterpret_cast<const RTCHit*>(args->hit);
  Collecting::keep(args->context, hit->geomID, hit->primID, hit->instID[0]);
  args->valid[0] = 0;  // the hit is rejected, so that the traversal continues
}

template <class Shape>
void intersect_callback(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* rh = reinterpret_cast<RTCRayHit*>(args->rayhit);
  const double t = shape_distance<Shape>(args->geometryUserPtr, args->primID, args->context, rh->ray);
  const auto tf = static_cast<float>(t);
  if (!(tf < rh->ray.tfar)) return;
  if (Tracing::of(args->context).collects)
    return Collecting::keep(args->context, args->geomID, args->primID, args->context->instID[0]);
  rh->ray.tfar = tf;
  rh->hit.primID = args->primID;
  rh->hit.geomID = args->geomID;
  rh->hit.instID[0] = args->context->instID[0];
}

template <class Shape>
void occluded_callback(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* ray = reinterpret_cast<RTCRay*>(args->ray);
  if (shape_distance<Shape>(args->geometryUserPtr, args->primID, args->context, *ray) < ray->tfar) {
    ray->tfar = -std::numeric_limits<float>::infinity();
  }
}

}  // namespace ls::render
