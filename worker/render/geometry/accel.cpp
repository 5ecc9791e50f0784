#include "worker/render/geometry/accel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <deque>
#include <optional>
#include <tuple>

#include "worker/render/base/build_stop.h"
#include "worker/render/geometry/accel_shapes.h"
#include "worker/render/geometry/embree.h"

namespace ls::render {
namespace {

// The primitives [first, last) of a PrimitiveRange that belong to one of its two sides. Side 0 contains the
// opaque primitives, side 1 those that let light pass.
struct Side {
  std::uint32_t first, last;
  std::uint32_t count() const { return last - first; }
};
Side side_of(const PrimitiveRange& r, int side) {
  return side ? Side{r.passing, r.last} : Side{r.first, r.passing};
}

#ifdef __x86_64__
constexpr char kDeviceConfig[] = "isa=avx2,max_isa=avx2,frequency_level=simd256,set_affinity=0";
#else
constexpr char kDeviceConfig[] = "set_affinity=0";  // on ARM Embree has one instruction set, NEON
#endif

// The Embree scenes over one set of primitives: all of them, the opaque ones, and those that let light pass.
// If no primitive lets light pass, `all` and `opaque` are the same scene.
struct Scenes {
  RTCScene all = nullptr, opaque = nullptr, boundary = nullptr;
  std::uint32_t base[2 * kKinds] = {};  // index of the first primitive, by kind + side * kKinds
  ShapeSet<Sphere> spheres[2];
  ShapeSet<Disk> disks[2];
  ShapeSet<Cylinder> cylinders[2];

  Scenes() = default;
  Scenes(const Scenes&) = delete;  // not copyable, since the BVH points at the shape sets
  Scenes& operator=(const Scenes&) = delete;
  ~Scenes() {
    for (RTCScene s : {all != opaque ? all : nullptr, opaque, boundary}) {
      if (s) rtcReleaseScene(s);
    }
  }
};

}  // namespace

struct Accel::State {
  RTCDevice device = nullptr;
  std::optional<Scenes> own;
  std::deque<Scenes> groups;
  std::vector<std::uint32_t> group_of;  // for each instance, the index of its group
  std::deque<MovingScene> moving;       // a deque, since the BVH points at its elements
  std::atomic<std::int64_t> bytes{0};
  bool coincident = false;

  ~State() {
    own.reset();
    groups.clear();
    if (device) rtcReleaseDevice(device);
  }
};

namespace {

RTCGeometry triangle_geometry(RTCDevice device, const Geometry& g, std::uint32_t first, std::uint32_t count) {
  RTCGeometry geom = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes per vertex: Geometry::build reserves the padding.
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

RTCScene new_scene(RTCDevice device, bool coincident) {
  RTCScene s = rtcNewScene(device);
  rtcSetSceneFlags(s, coincident ? static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | kFilterOfQuery)
                                 : RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(s, RTC_BUILD_QUALITY_MEDIUM);
  return s;
}

void attach(RTCDevice device, const Geometry& g, const PrimitiveSet& set, Scenes& to, int side,
            std::initializer_list<RTCScene> scenes) {
  const unsigned first_id = static_cast<unsigned>(side) * kKinds;
  const auto add = [&](RTCGeometry geom, unsigned kind) {
    const unsigned id = first_id + kind + (&set == &g.own ? 0u : kInGroup);
    for (RTCScene s : scenes) rtcAttachGeometryByID(s, geom, id);
    rtcReleaseGeometry(geom);
  };
  const auto add_shapes = [&](const auto& all, const PrimitiveRange& range, auto& part, unsigned kind) {
    const Side s = side_of(range, side);
    to.base[first_id + kind] = s.first;
    part.shapes = std::span(all).subspan(s.first, s.count());
    part.instances = g.instances.data();
    if (s.count() > 0) add(shape_geometry(device, part), kind);
  };
  const Side triangles = side_of(set.triangles, side);
  to.base[first_id + kTriangles] = triangles.first;
  if (triangles.count() > 0)
    add(triangle_geometry(device, g, triangles.first, triangles.count()), kTriangles);
  add_shapes(g.spheres, set.spheres, to.spheres[side], kSpheres);
  add_shapes(g.disks, set.disks, to.disks[side], kDisks);
  add_shapes(g.cylinders, set.cylinders, to.cylinders[side], kCylinders);
}

// Creates the Embree scenes `to` and adds the primitives of `set` to them. `boundaries` is true if `set`, or
// an instance that is added later, has primitives that let light pass; `to` then has scenes of its own for
// opaque primitives and for these. The caller has to add the instances, if any, and to commit the scenes.
void fill(const Accel::State& st, const Geometry& g, const PrimitiveSet& set, bool boundaries, Scenes& to) {
  const RTCDevice device = st.device;
  // The second argument of new_scene() is true for the scene that between() traces, which needs filters for
  // hits. This scene is `all`, and without boundaries `all` is the same scene as `opaque`.
  to.opaque = new_scene(device, st.coincident && !boundaries);
  if (!boundaries) {
    to.all = to.opaque;
    return attach(device, g, set, to, 0, {to.opaque});
  }
  to.all = new_scene(device, st.coincident);
  to.boundary = new_scene(device, false);
  attach(device, g, set, to, 0, {to.opaque, to.all});
  attach(device, g, set, to, 1, {to.boundary, to.all});
}

// Builds the BVHs of the scenes. If the build should stop (BuildStop), it ends early, and the scenes are of
// no use.
void commit(const Scenes& s) {
  const std::atomic<bool>* const stop = BuildStop::flag();
  for (RTCScene scene : {s.all != s.opaque ? s.all : nullptr, s.boundary, s.opaque}) {
    if (!scene || (stop && *stop)) continue;
    if (stop)
      rtcSetSceneProgressMonitorFunction(
          scene, [](void* p, double /*done*/) { return !*static_cast<const std::atomic<bool>*>(p); },
          const_cast<std::atomic<bool>*>(stop));
    rtcCommitScene(scene);
    if (stop) rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
  }
}

void attach_instance(RTCDevice device, const Affine& to_world, RTCScene of, unsigned id,
                     std::initializer_list<RTCScene> scenes) {
  RTCGeometry geom = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geom, of);
  const auto& a = to_world.a;
  const V3 b(to_world.b);
  const float matrix[12] = {
      static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2]), b.x,
      static_cast<float>(a[3]), static_cast<float>(a[4]), static_cast<float>(a[5]), b.y,
      static_cast<float>(a[6]), static_cast<float>(a[7]), static_cast<float>(a[8]), b.z};
  rtcSetGeometryTransform(geom, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, matrix);
  rtcCommitGeometry(geom);
  for (RTCScene s : scenes) rtcAttachGeometryByID(s, geom, id);
  rtcReleaseGeometry(geom);
}

// Returns a box around the primitives of a group, in its space.
Box box_of(const Geometry& g, const PrimitiveSet& set) {
  Box box;
  for (std::uint32_t i = set.triangles.first; i < set.triangles.last; ++i)
    for (int k = 0; k < 3; ++k) box.add(V3d(g.vertex(i, k)));
  for (std::uint32_t i = set.spheres.first; i < set.spheres.last; ++i) box.add(box_of(g.spheres[i]));
  for (std::uint32_t i = set.disks.first; i < set.disks.last; ++i) box.add(box_of(g.disks[i]));
  for (std::uint32_t i = set.cylinders.first; i < set.cylinders.last; ++i) box.add(box_of(g.cylinders[i]));
  return box;
}

void attach_moving(const Geometry& g, Accel::State& st, std::uint32_t instance, RTCScene group,
                   std::initializer_list<RTCScene> scenes) {
  const PlacedInstance& placed = g.instances[instance];
  const MovingInstance& mover = g.moving[placed.moving];
  MovingScene& moving = st.moving.emplace_back();
  moving.instances = g.instances.data();
  moving.instance = instance;
  moving.group = group;
  const Box box = box_of(g, g.groups[placed.group]);
  const std::size_t parts = mover.parts(box);
  moving.boxes.resize(parts + 1);
  for (std::size_t i = 0; i < parts; ++i) {
    const auto time = [&](std::size_t k) { return static_cast<double>(k) / static_cast<double>(parts); };
    const Box during = mover.box(box, time(i), time(i + 1));
    moving.boxes[i].add(during);
    moving.boxes[i + 1].add(during);
  }
  RTCGeometry geom = rtcNewGeometry(st.device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geom, 1);
  rtcSetGeometryTimeStepCount(geom, static_cast<unsigned>(moving.boxes.size()));
  rtcSetGeometryUserData(geom, &moving);
  rtcSetGeometryBoundsFunction(geom, moving_bounds_callback, nullptr);
  rtcSetGeometryIntersectFunction(geom, moving_intersect_callback);
  rtcSetGeometryOccludedFunction(geom, moving_occluded_callback);
  rtcCommitGeometry(geom);
  for (RTCScene s : scenes) rtcAttachGeometryByID(s, geom, kFirstInstance + instance);
  rtcReleaseGeometry(geom);
}

void attach_instances(const Geometry& g, Accel::State& st) {
  Scenes& own = *st.own;
  const auto attach = [&](std::uint32_t i, RTCScene group, std::initializer_list<RTCScene> scenes) {
    if (g.instances[i].moving != kNone) return attach_moving(g, st, i, group, scenes);
    attach_instance(st.device, g.instances[i].to_world, group, kFirstInstance + i, scenes);
  };
  for (std::uint32_t i = 0; i < g.instances.size(); ++i) {
    const PlacedInstance& instance = g.instances[i];
    st.group_of.push_back(instance.group);
    if (g.groups[instance.group].count() == 0) continue;
    const Scenes& group = st.groups[instance.group];
    if (own.all == own.opaque) {
      attach(i, group.all, {own.opaque});
    } else if (!group.boundary) {
      attach(i, group.all, {own.opaque, own.all});
    } else {
      attach(i, group.all, {own.all});
      attach(i, group.boundary, {own.boundary});
      if (g.groups[instance.group].any_opaque()) attach(i, group.opaque, {own.opaque});
    }
  }
}

PrimitiveId primitive_in(const Scenes& in, unsigned geometry, unsigned primitive, std::uint32_t instance) {
  return {static_cast<PrimitiveId::Kind>(geometry % kKinds), in.base[geometry] + primitive, instance};
}
// Returns the primitive of a hit in an instance. Not inlined, to keep it out of the code for primitives
// outside of groups.
[[gnu::noinline]] PrimitiveId instanced(const Accel::State& st, const RTCHit& hit) {
  const std::uint32_t instance = hit.instID[0] - kFirstInstance;
  return primitive_in(st.groups[st.group_of[instance]], hit.geomID - kInGroup, hit.primID, instance);
}
// Returns the primitive that `hit` names; nullopt if the ray hit nothing.
[[gnu::always_inline]] inline std::optional<PrimitiveId> primitive_of(const Accel::State& st,
                                                                      const RTCHit& hit) {
  static_assert(RTC_INVALID_GEOMETRY_ID >= kInGroup);
  if (hit.geomID < kInGroup) return primitive_in(*st.own, hit.geomID, hit.primID, kNone);
  if (hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return instanced(st, hit);
}

[[gnu::always_inline]] inline std::optional<PrimitiveId> trace(const Accel::State& st, RTCScene scene,
                                                               const V3& o, const V3& d, float t_max,
                                                               const Moment* moment) {
  if (!near_enough(o) || !is_finite(d)) return std::nullopt;
  RTCRayHit rh;
  set_ray(rh.ray, o, d, t_max, moment ? moment->time() : 0);
  rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Tracing tracing(o, d, moment);
  embree_intersect(scene, tracing.context, rh, nullptr);
  return primitive_of(st, rh.hit);
}

[[gnu::always_inline]] inline bool is_occluded(const Accel::State& st, const V3& o, const V3& d, float t_max,
                                               const Moment* moment) {
  if (!near_enough(o) || !is_finite(d)) return !is_finite(o) || !is_finite(d);
  RTCRay ray;
  set_ray(ray, o, d, t_max, moment ? moment->time() : 0);
  Tracing tracing(o, d, moment);
  embree_occluded(st.own->opaque, tracing.context, ray);
  return ray.tfar < 0;
}

// Returns the version of the loaded Embree library, which may differ from that of the headers.
ssize_t loaded_version() {
  const RTCDevice device = rtcNewDevice(fmt::format("threads=1,user_threads=0,{}", kDeviceConfig).c_str());
  const ssize_t version = device ? rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) : 0;
  if (device) rtcReleaseDevice(device);
  return version;
}

}  // namespace

Accel::Accel() = default;
Accel::~Accel() = default;
Accel::Accel(Accel&&) noexcept = default;
Accel& Accel::operator=(Accel&&) noexcept = default;

Result<Accel> Accel::build(const Geometry& g, int threads, bool coincident) {
  Accel a;
  a.state_ = std::make_unique<State>();
  State& st = *a.state_;
  st.coincident = coincident;
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
  bool boundaries = g.own.any_passing();
  for (const PrimitiveSet& set : g.groups) {
    Scenes& scenes = st.groups.emplace_back();
    fill(st, g, set, set.any_passing(), scenes);
    commit(scenes);
    boundaries = boundaries || set.any_passing();
  }
  fill(st, g, g.own, boundaries, st.own.emplace());
  attach_instances(g, st);
  commit(*st.own);
  if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
  if (const RTCError e = rtcGetDeviceError(st.device); e != RTC_ERROR_NONE) {
    return fail(e == RTC_ERROR_OUT_OF_MEMORY ? Errc::resource_exhausted : Errc::internal,
                fmt::format("Embree could not build the scene's BVH (code {})", static_cast<int>(e)));
  }
  return a;
}

std::optional<PrimitiveId> Accel::nearest(const V3& o, const V3& d, float t_max) const {
  return trace(*state_, state_->own->all, o, d, t_max, nullptr);
}
std::optional<PrimitiveId> Accel::nearest(const V3& o, const V3& d, float t_max, const Moment& moment) const {
  return trace(*state_, state_->own->all, o, d, t_max, &moment);
}

std::optional<PrimitiveId> Accel::nearest_boundary(const V3& o, const V3& d, float t_max) const {
  if (!state_->own->boundary) return std::nullopt;
  return trace(*state_, state_->own->boundary, o, d, t_max, nullptr);
}
std::optional<PrimitiveId> Accel::nearest_boundary(const V3& o, const V3& d, float t_max,
                                                   const Moment& moment) const {
  if (!state_->own->boundary) return std::nullopt;
  return trace(*state_, state_->own->boundary, o, d, t_max, &moment);
}

CoincidentHits Accel::between(const V3& a, const V3& b, const Moment* moment) const {
  CoincidentHits coincident_hits;
  const V3 d = b - a;
  if (!state_->coincident || !near_enough(a) || !near_enough(b)) return coincident_hits;
  RTCRayHit rh;
  set_ray(rh.ray, a, d, 1, moment ? moment->time() : 0);
  rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Collecting all(a, d, moment);
  embree_intersect(state_->own->all, all.context, rh, collect_callback);
  for (std::size_t i = 0; i < all.count; ++i) coincident_hits.ids[i] = *primitive_of(*state_, all.met[i]);
  // A triangle may be reported once for every leaf that contains part of it.
  const auto first = coincident_hits.ids.begin(), last = first + static_cast<std::ptrdiff_t>(all.count);
  std::sort(first, last, [](const PrimitiveId& x, const PrimitiveId& y) {
    return std::tie(x.kind, x.index, x.instance) < std::tie(y.kind, y.index, y.instance);
  });
  coincident_hits.count = static_cast<int>(std::unique(first, last) - first);
  return coincident_hits;
}

bool Accel::occluded(const V3& o, const V3& d, float t_max) const {
  return is_occluded(*state_, o, d, t_max, nullptr);
}
bool Accel::occluded(const V3& o, const V3& d, float t_max, const Moment& moment) const {
  return is_occluded(*state_, o, d, t_max, &moment);
}

bool Accel::has_boundaries() const { return state_->own->boundary != nullptr; }
std::uint64_t Accel::bytes() const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, state_->bytes));
}
std::string Accel::describe() { return fmt::format("embree {} {}", loaded_version(), kDeviceConfig); }
std::string Accel::version() {
  const auto v = loaded_version();
  return fmt::format("{}.{}.{}", v / 10000, v / 100 % 100, v % 100);
}

}  // namespace ls::render
