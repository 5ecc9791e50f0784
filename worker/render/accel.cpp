#include "worker/render/accel.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

namespace ls::render {
namespace {

constexpr char kDeviceConfig[] = "isa=avx2,max_isa=avx2,frequency_level=simd256,set_affinity=0";

// Spheres and disks are user geometries: their intersection is our own double-precision code.
template <class Shape>
struct ShapeSet {
  std::span<const Shape> shapes;
};

V3d bounds_radius(const Sphere& s) { return V3d(s.radius); }
V3d bounds_radius(const Disk& s) {
  V3d r;
  for (int k = 0; k < 3; ++k) r[k] = std::sqrt(s.u[k] * s.u[k] + s.v[k] * s.v[k]);
  return r;
}

template <class Shape>
void bounds_callback(const RTCBoundsFunctionArguments* args) {
  const Shape& s = static_cast<const ShapeSet<Shape>*>(args->geometryUserPtr)->shapes[args->primID];
  // Rounded outwards by more than the last place of the coordinates.
  const V3d r = bounds_radius(s) * (1 + 1e-6) + V3d(1e-6);
  const V3 lo(s.center - r), hi(s.center + r);
  *args->bounds_o = {lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, 0};
}

template <class Shape>
double shape_distance(const void* user, unsigned prim, const RTCRay& ray) {
  const Shape& s = static_cast<const ShapeSet<Shape>*>(user)->shapes[prim];
  return intersect(s, V3d(ray.org_x, ray.org_y, ray.org_z), V3d(ray.dir_x, ray.dir_y, ray.dir_z), ray.tnear,
                   ray.tfar);
}

template <class Shape>
void intersect_callback(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* rh = reinterpret_cast<RTCRayHit*>(args->rayhit);
  const double t = shape_distance<Shape>(args->geometryUserPtr, args->primID, rh->ray);
  const auto tf = static_cast<float>(t);
  if (!(tf < rh->ray.tfar)) return;
  rh->ray.tfar = tf;
  rh->hit.primID = args->primID;
  rh->hit.geomID = args->geomID;
  rh->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

template <class Shape>
void occluded_callback(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto* ray = reinterpret_cast<RTCRay*>(args->ray);
  if (shape_distance<Shape>(args->geometryUserPtr, args->primID, *ray) < ray->tfar) {
    ray->tfar = -std::numeric_limits<float>::infinity();
  }
}

// Geometry ids, the same in every scene they are attached to.
enum : unsigned { kTriangles = 0, kSpheres = 1, kDisks = 2, kKinds = 3 };

// Written in the 16-byte words that Embree reads: a load of several smaller stores has to wait for them.
using F32x4 = float __attribute__((vector_size(16)));
using U32x4 = std::uint32_t __attribute__((vector_size(16)));
void set_ray(RTCRay& r, const V3& o, const V3& d, float t_max) {
  static_assert(offsetof(RTCRay, tnear) == 12 && offsetof(RTCRay, dir_x) == 16 &&
                offsetof(RTCRay, tfar) == 32 && offsetof(RTCRay, flags) == 44);
  const F32x4 origin = {o.x, o.y, o.z, 0}, direction = {d.x, d.y, d.z, 0};
  const U32x4 rest = {std::bit_cast<std::uint32_t>(t_max), ~0u, 0, 0};  // tfar, mask, id, flags
  std::memcpy(&r.org_x, &origin, sizeof origin);
  std::memcpy(&r.dir_x, &direction, sizeof direction);
  std::memcpy(&r.tfar, &rest, sizeof rest);
}

bool traceable(const V3& o, const V3& d) {  // Embree's behaviour on NaN is undefined
  return is_finite(o) && is_finite(d);
}

}  // namespace

struct Accel::State {
  RTCDevice device = nullptr;
  RTCScene all = nullptr, opaque = nullptr,
           boundary = nullptr;         // all == opaque where there are no boundaries
  std::uint32_t base[2][kKinds] = {};  // first index of each kind: opaque, boundary
  ShapeSet<Sphere> spheres[2];
  ShapeSet<Disk> disks[2];
  std::atomic<std::int64_t> bytes{0};

  ~State() {
    for (RTCScene s : {all != opaque ? all : nullptr, opaque, boundary}) {
      if (s) rtcReleaseScene(s);
    }
    if (device) rtcReleaseDevice(device);
  }
};

namespace {

RTCGeometry triangle_geometry(RTCDevice device, const Geometry& g, std::uint32_t first, std::uint32_t count) {
  RTCGeometry geom = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes a vertex: the array is padded by Geometry's own reserve (see build()).
  rtcSetSharedGeometryBuffer(geom, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, g.positions.data(), 0,
                             sizeof(V3), g.positions.size());
  rtcSetSharedGeometryBuffer(geom, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             g.indices.data() + std::size_t{3} * first, 0, 3 * sizeof(std::uint32_t), count);
  rtcSetGeometryBuildQuality(geom, RTC_BUILD_QUALITY_MEDIUM);
  rtcCommitGeometry(geom);
  return geom;
}

template <class Shape>
RTCGeometry shape_geometry(RTCDevice device, ShapeSet<Shape>& set) {
  RTCGeometry geom = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geom, static_cast<unsigned>(set.shapes.size()));
  rtcSetGeometryUserData(geom, &set);
  rtcSetGeometryBoundsFunction(
      geom, [](const RTCBoundsFunctionArguments* a) { bounds_callback<Shape>(a); }, nullptr);
  rtcSetGeometryIntersectFunction(geom, intersect_callback<Shape>);
  rtcSetGeometryOccludedFunction(geom, occluded_callback<Shape>);
  rtcCommitGeometry(geom);
  return geom;
}

RTCScene new_scene(RTCDevice device) {
  RTCScene s = rtcNewScene(device);
  rtcSetSceneFlags(s, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(s, RTC_BUILD_QUALITY_MEDIUM);
  return s;
}

// side 0: opaque, 1: boundaries. Attached under the ids kind + side * kKinds.
void attach(RTCDevice device, const Geometry& g, Accel::State& st, int side,
            std::initializer_list<RTCScene> scenes) {
  const std::uint32_t t0 = side ? g.opaque_triangles : 0, t1 = side ? g.triangle_count() : g.opaque_triangles;
  const std::uint32_t s0 = side ? g.opaque_spheres : 0, d0 = side ? g.opaque_disks : 0;
  const std::size_t s1 = side ? g.spheres.size() : g.opaque_spheres,
                    d1 = side ? g.disks.size() : g.opaque_disks;
  st.base[side][kTriangles] = t0;
  st.base[side][kSpheres] = s0;
  st.base[side][kDisks] = d0;
  st.spheres[side].shapes = std::span(g.spheres).subspan(s0, s1 - s0);
  st.disks[side].shapes = std::span(g.disks).subspan(d0, d1 - d0);
  const auto add = [&](RTCGeometry geom, unsigned kind) {
    for (RTCScene s : scenes) rtcAttachGeometryByID(s, geom, kind + static_cast<unsigned>(side) * kKinds);
    rtcReleaseGeometry(geom);
  };
  if (t1 > t0) add(triangle_geometry(device, g, t0, t1 - t0), kTriangles);
  if (!st.spheres[side].shapes.empty()) add(shape_geometry(device, st.spheres[side]), kSpheres);
  if (!st.disks[side].shapes.empty()) add(shape_geometry(device, st.disks[side]), kDisks);
}

std::optional<PrimitiveId> trace(const Accel::State& st, RTCScene scene, const V3& o, const V3& d,
                                 float t_max) {
  if (!traceable(o, d)) return std::nullopt;
  RTCRayHit rh;
  set_ray(rh.ray, o, d, t_max);
  rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &rh);
  if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const unsigned side = rh.hit.geomID / kKinds, kind = rh.hit.geomID % kKinds;
  return PrimitiveId{static_cast<PrimitiveId::Kind>(kind), st.base[side][kind] + rh.hit.primID};
}

}  // namespace

Accel::Accel() = default;
Accel::~Accel() = default;
Accel::Accel(Accel&&) noexcept = default;
Accel& Accel::operator=(Accel&&) noexcept = default;

Result<Accel> Accel::build(const Geometry& g, int threads) {
  Accel a;
  a.state_ = std::make_unique<State>();
  State& st = *a.state_;
  st.device =
      rtcNewDevice(fmt::format("threads={},user_threads=0,{}", std::max(1, threads), kDeviceConfig).c_str());
  if (!st.device)
    return fail(Errc::internal,
                fmt::format("Embree does not start (code {})", static_cast<int>(rtcGetDeviceError(nullptr))));
  rtcSetDeviceMemoryMonitorFunction(
      st.device,
      [](void* p, ssize_t n, bool) {
        static_cast<State*>(p)->bytes += n;
        return true;
      },
      &st);
  const bool boundaries = g.triangle_count() > g.opaque_triangles || g.spheres.size() > g.opaque_spheres ||
                          g.disks.size() > g.opaque_disks;
  st.opaque = new_scene(st.device);
  if (boundaries) {
    st.all = new_scene(st.device);
    st.boundary = new_scene(st.device);
    attach(st.device, g, st, 0, {st.opaque, st.all});
    attach(st.device, g, st, 1, {st.boundary, st.all});
    rtcCommitScene(st.all);
    rtcCommitScene(st.boundary);
  } else {
    st.all = st.opaque;
    attach(st.device, g, st, 0, {st.opaque});
  }
  rtcCommitScene(st.opaque);
  if (const RTCError e = rtcGetDeviceError(st.device); e != RTC_ERROR_NONE) {
    return fail(e == RTC_ERROR_OUT_OF_MEMORY ? Errc::resource_exhausted : Errc::internal,
                fmt::format("Embree could not build the scene's BVH (code {})", static_cast<int>(e)));
  }
  return a;
}

std::optional<PrimitiveId> Accel::nearest(const V3& o, const V3& d, float t_max) const {
  return trace(*state_, state_->all, o, d, t_max);
}

std::optional<PrimitiveId> Accel::nearest_boundary(const V3& o, const V3& d, float t_max) const {
  if (!state_->boundary) return std::nullopt;
  return trace(*state_, state_->boundary, o, d, t_max);
}

bool Accel::occluded(const V3& o, const V3& d, float t_max) const {
  if (!traceable(o, d)) return true;
  RTCRay ray;
  set_ray(ray, o, d, t_max);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(state_->opaque, &context, &ray);
  return ray.tfar < 0;
}

bool Accel::has_boundaries() const { return state_->boundary != nullptr; }
std::uint64_t Accel::bytes() const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, state_->bytes));
}
std::string Accel::describe() {
  // The version of the library that was loaded, which the headers do not know.
  const RTCDevice device = rtcNewDevice(fmt::format("threads=1,user_threads=0,{}", kDeviceConfig).c_str());
  const auto version = device ? rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) : 0;
  if (device) rtcReleaseDevice(device);
  return fmt::format("embree {} {}", version, kDeviceConfig);
}

}  // namespace ls::render
