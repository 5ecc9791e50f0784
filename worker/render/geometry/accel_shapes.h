// Part of accel.cpp: Embree callbacks for spheres, disks and cylinders, for instances that move, and for
// collecting all primitives along a ray.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "worker/render/base/work_counters.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/embree.h"
#include "worker/render/geometry/moment.h"
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

// set_ray() writes the ray in 16-byte words, as Embree reads it. If it wrote smaller words, the processor
// could not forward them to a load that spans several of them, and the load would wait.
using F32x4 = float __attribute__((vector_size(16)));
using U32x4 = std::uint32_t __attribute__((vector_size(16)));
inline void set_ray(RTCRay& r, const V3& o, const V3& d, float t_max, float time) {
  static_assert(offsetof(RTCRay, tnear) == 12 && offsetof(RTCRay, dir_x) == 16 &&
                offsetof(RTCRay, time) == 28 && offsetof(RTCRay, tfar) == 32 &&
                offsetof(RTCRay, flags) == 44);
  const F32x4 origin = {o.x, o.y, o.z, 0}, direction = {d.x, d.y, d.z, time};
  const U32x4 rest = {std::bit_cast<std::uint32_t>(t_max), ~0u, 0, 0};  // tfar, mask, id, flags
  std::memcpy(&r.org_x, &origin, sizeof origin);
  std::memcpy(&r.dir_x, &direction, sizeof direction);
  std::memcpy(&r.tfar, &rest, sizeof rest);
}

// True if Embree can trace a ray from o. Embree's behaviour is undefined for NaN, and Debian's build of it
// aborts for rays whose origin is farther than 1.8e18. For rays transformed into instances, kLargestInverse
// (geometry_build.cpp) ensures the same.
inline bool near_enough(const V3& o) { return dot(o, o) <= 1e18f; }  // within 1e9 times the world's size

// Returns the box in float32, enlarged by more than the last digit of its coordinates, so that rounding
// cannot cut what is inside.
inline RTCBounds bounds_of(const Box& b) {
  const V3d margin = (b.hi - b.lo) * .5e-6 + V3d(1e-6);
  const V3 lo(b.lo - margin), hi(b.hi + margin);
  return {lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, 0};
}

template <class Shape>
void bounds_callback(const RTCBoundsFunctionArguments* args) {
  const Shape& s = static_cast<const ShapeSet<Shape>*>(args->geometryUserPtr)->shapes[args->primID];
  *args->bounds_o = bounds_of(box_of(s));
}

// The data about the ray that a callback needs: Embree's context, the ray's origin o and direction d in world
// space, and its time; without a moment, all that moves is where it is at time 0. Inside an instance Embree
// passes to the callback only the ray as transformed, in float32, to the group's space.
struct Tracing {
  EmbreeContext context;
  const V3 *o, *d;
  const Moment* moment;
  bool collects = false;  // true if this object is a Collecting

  Tracing(const V3& origin, const V3& direction, const Moment* at) : o(&origin), d(&direction), moment(at) {
    embree_start(context);
  }
  const PlacedInstance& placed(const PlacedInstance* instances, std::uint32_t i) const {
    return moment ? moment->placed(i) : instances[i];
  }

  static Tracing& of(EmbreeContext* context) { return *reinterpret_cast<Tracing*>(context); }
};

// Not inlined, to keep it out of the code for shapes outside of groups.
template <class Shape>
[[gnu::noinline]] double distance_in_group(const ShapeSet<Shape>& set, const Shape& s, EmbreeContext* context,
                                           const RTCRay& ray) {
  // This is the same computation as in Geometry::complete_instanced, so that both find the same hits.
  const Tracing& tracing = Tracing::of(context);
  const PlacedInstance& i = tracing.placed(set.instances, context->instID[0] - kFirstInstance);
  return intersect(s, i.to_local.point(V3d(*tracing.o)), i.to_local.vector(V3d(*tracing.d)), ray.tnear,
                   ray.tfar);
}

template <class Shape>
[[gnu::always_inline]] inline double shape_distance(const void* user, unsigned prim, EmbreeContext* context,
                                                    const RTCRay& ray) {
  LS_COUNT(user_geometry);
  const auto& set = *static_cast<const ShapeSet<Shape>*>(user);
  const Shape& s = set.shapes[prim];
  if (context->instID[0] != RTC_INVALID_GEOMETRY_ID) return distance_in_group(set, s, context, ray);
  return intersect(s, V3d(ray.org_x, ray.org_y, ray.org_z), V3d(ray.dir_x, ray.dir_y, ray.dir_z), ray.tnear,
                   ray.tfar);
}

// The state of a trace that collects all hits along the ray. Its filter rejects every hit, so that Embree
// continues.
struct Collecting : Tracing {
  Collecting(const V3& origin, const V3& direction, const Moment* at) : Tracing(origin, direction, at) {
    collects = true;
  }
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

// An instance that moves, as Embree sees it: a user geometry of one primitive, whose callback traces the ray
// through the scene of its group. Embree's own instances would interpolate their transforms in single
// precision, and so find other hits than Geometry::complete().
struct MovingScene {
  const PlacedInstance* instances = nullptr;  // Geometry::instances
  std::uint32_t instance = 0;
  RTCScene group = nullptr;
  // For the end of each part of the exposure, beginning with that of the first: a box that holds the instance
  // during the parts on both sides. What lies linearly between the boxes of two ends then holds it as well.
  std::vector<Box> boxes;
};

inline void moving_bounds_callback(const RTCBoundsFunctionArguments* args) {
  const auto& moving = *static_cast<const MovingScene*>(args->geometryUserPtr);
  *args->bounds_o = bounds_of(moving.boxes[args->timeStep]);
}

// Traces the ray through the group of an instance that moves; `trace(scene, ray)` does so for a ray in the
// group's space, of which only origin, direction and times are set.
template <class Trace>
void trace_moving(const MovingScene& moving, EmbreeContext* context, const RTCRay& ray, const Trace& trace) {
  LS_COUNT(instances);
  const Tracing& tracing = Tracing::of(context);
  const PlacedInstance& placed = tracing.placed(moving.instances, moving.instance);
  // The same maps as in Geometry::complete_instanced
  const V3 o(placed.to_local.point(V3d(*tracing.o))), d(placed.to_local.vector(V3d(*tracing.d)));
  if (!near_enough(o) || !is_finite(d)) return;
  context->instID[0] = kFirstInstance + moving.instance;
  trace(moving.group, o, d, ray.tfar);
  context->instID[0] = RTC_INVALID_GEOMETRY_ID;
}

inline void moving_intersect_callback(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* rh = reinterpret_cast<RTCRayHit*>(args->rayhit);
  trace_moving(*static_cast<const MovingScene*>(args->geometryUserPtr), args->context, rh->ray,
               [&](RTCScene group, const V3& o, const V3& d, float t_max) {
                 RTCRayHit local;
                 set_ray(local.ray, o, d, t_max, 0);
                 local.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                 embree_intersect(group, *args->context, local,
                                  Tracing::of(args->context).collects ? collect_callback : nullptr);
                 if (local.hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
                 rh->ray.tfar = local.ray.tfar;
                 rh->hit.primID = local.hit.primID;
                 rh->hit.geomID = local.hit.geomID;
                 rh->hit.instID[0] = args->context->instID[0];
               });
}

inline void moving_occluded_callback(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* ray = reinterpret_cast<RTCRay*>(args->ray);
  trace_moving(*static_cast<const MovingScene*>(args->geometryUserPtr), args->context, *ray,
               [&](RTCScene group, const V3& o, const V3& d, float t_max) {
                 RTCRay local;
                 set_ray(local, o, d, t_max, 0);
                 embree_occluded(group, *args->context, local);
                 if (local.tfar < 0) ray->tfar = -std::numeric_limits<float>::infinity();
               });
}

}  // namespace ls::render
