#include "worker/render/geometry/geometry.h"

#include <cmath>
#include <limits>

#include "worker/render/base/work_counters.h"
#include "worker/render/geometry/moment.h"

namespace ls::render {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

struct Barycentric {
  double t, u, v;  // the hit is at o + t d = v0 + u (v1 - v0) + v (v2 - v0), with the corners v0, v1, v2
};

// Intersects a triangle with the corner v0 and the edges e1 and e2. It divides in double and never uses the
// processor's reciprocal estimates, whose bits differ between manufacturers.
bool meet_triangle(const V3d& v0, const V3d& e1, const V3d& e2, const V3d& o, const V3d& d, Barycentric& b) {
  const V3d p = d.cross(e2);
  const double det = e1.dot(p);
  if (det == 0) return false;
  const V3d s = o - v0;
  const V3d q = s.cross(e1);
  const double inverse = 1 / det;
  b = {e2.dot(q) * inverse, s.dot(p) * inverse, d.dot(q) * inverse};
  return std::isfinite(b.t) && std::isfinite(b.u) && std::isfinite(b.v);
}

// Moves a hit away from the edges of its triangle. The BVH decides in float32 which triangle is hit; near an
// edge the exact hit may lie just outside of the triangle, and rounding the point to float32 moves it by up
// to sqrt(3) 2^-24 reach more. `reach` is SurfaceHit::reach, the largest coordinate in the computation. If
// another wall of a room begins at the edge, the point may then be behind that wall, and light would leak in.
// So points keep a distance of 2^-22 reach from every edge, but at most a quarter of the triangle's height
// over it. `twice_area` is twice the area of the triangle.
[[gnu::noinline]] void keep_from_edges(const V3d& e1, const V3d& e2, double twice_area, float reach,
                                       Barycentric& b) {
  const double w = 1 - b.u - b.v;
  // A distance from an edge, divided by the triangle's height over this edge, is a difference of barycentric
  // coordinates. The height is twice the area over the edge's length. So for the distance 2^-22 reach the
  // difference is `margin` times the edge's length.
  const double margin = 0x1p-22 * reach / twice_area;
  const auto least = [&](const V3d& edge) { return std::min(.25, margin * edge.length()); };
  const double lw = least(e2 - e1), lu = least(e2), lv = least(e1);
  const double u = std::max(0., b.u - lu), v = std::max(0., b.v - lv), rest = std::max(0., w - lw);
  const double k = (1 - lu - lv - lw) / (u + v + rest);
  b.u = lu + u * k;
  b.v = lv + v * k;
}

// Completes the hit on triangle i. o and d are in the triangle's space: the world's space in single precision
// (V = V3), or a group's in double (V = V3d).
template <class V>
[[gnu::always_inline]] inline bool complete_triangle(const Geometry& g, std::uint32_t i, const V& o,
                                                     const V& d, SurfaceHit& hit) {
  const std::uint32_t* idx = &g.indices[3 * i];
  const V3d v0(g.positions[idx[0]]), v1(g.positions[idx[1]]), v2(g.positions[idx[2]]);
  const V3d e1 = v1 - v0, e2 = v2 - v0;
  Barycentric b;
  if (!meet_triangle(v0, e1, e2, V3d(o), V3d(d), b)) return false;
  const V3d n = e1.cross(e2);
  const double twice_area = n.length();
  hit.surface = g.triangle_surface[i];
  const SurfaceInfo& s = g.surfaces[hit.surface];
  hit.reach = s.reach > 0 ? s.reach : g.reach_of(i);
  if (!(std::min(1 - b.u - b.v, std::min(b.u, b.v)) > s.edge))
    keep_from_edges(e1, e2, twice_area, hit.reach, b);
  // The BVH computes in float32: to it, a surface just behind the origin may lie before it. A negative
  // distance would take light away.
  hit.t = std::max(0.f, static_cast<float>(b.t));
  hit.p = V3(v0 + e1 * b.u + e2 * b.v);
  hit.ng = V3(n * (s.orientation / twice_area));
  const auto u = static_cast<float>(b.u), v = static_cast<float>(b.v), w = 1 - u - v;
  hit.uv = {u, v};
  if (s.wants_attributes) [[unlikely]]
    hit.face = {hit.surface, i, u, v};
  if (s.uvs && s.wants_uv) hit.uv = g.uvs[idx[0]] * w + g.uvs[idx[1]] * u + g.uvs[idx[2]] * v;
  V3 ns = hit.ng;
  if (s.normals) {
    const V3 m = g.normals[idx[0]] * w + g.normals[idx[1]] * u + g.normals[idx[2]] * v;
    if (dot(m, m) > 0) ns = normalize(m) * s.orientation;
    // At silhouettes interpolated normals may face away from a viewer in front of the surface: used unchanged
    // they would put the path behind the surface, and light from behind would leak through.
    if ((dot(ns, V3(d)) < 0) != (dot(hit.ng, V3(d)) < 0)) {
      ns = hit.ng;
      hit.normal_replaced = true;
    }
  }
  if (!s.wants_tangent) {
    hit.shading = Frame(ns);
    return true;
  }
  V3 tangent(e1), bitangent(e2);
  if (s.uvs) {
    const V2 du = g.uvs[idx[1]] - g.uvs[idx[0]], dv = g.uvs[idx[2]] - g.uvs[idx[0]];
    const float det = du.x * dv.y - du.y * dv.x;
    if (det != 0) tangent = V3(e1 * (dv.y / det) - e2 * (du.y / det));
    if (det != 0 && s.wants_slopes) bitangent = V3(e2 * (du.x / det) - e1 * (dv.x / det));
  }
  hit.shading = Frame::from_tangent(ns, tangent);
  if (s.wants_slopes) hit.set_slopes(tangent, bitangent, g.scale);
  return true;
}

// Returns the unit direction n from the sphere's centre in the sphere's own axes, whose z points to a pole.
V3d local_direction(const Sphere& s, const V3d& n) {
  const auto* r = s.to_local;
  return {r[0] * n.x + r[1] * n.y + r[2] * n.z, r[3] * n.x + r[4] * n.y + r[5] * n.z,
          r[6] * n.x + r[7] * n.y + r[8] * n.z};
}

V2 uv_of(const V3d& local) {
  double angle = std::atan2(local.y, local.x);
  if (angle < 0) angle += 2 * kPiD;
  return {static_cast<float>(angle) * kInvTwoPi,
          static_cast<float>(std::acos(std::clamp(local.z, -1., 1.))) * kInvPi};
}

bool complete_sphere(const Geometry& g, std::uint32_t i, const V3d& o, const V3d& d, SurfaceHit& hit) {
  const Sphere& s = g.spheres[i];
  const double t = intersect(s, o, d, 0, kInf);
  if (t == kInf) return false;
  hit.t = static_cast<float>(t);
  V3d n = o + d * t - s.center;
  const double l = n.length();
  if (!(l > 0)) return false;
  n /= l;
  hit.p = V3(s.center + n * s.radius);
  hit.surface = s.surface;
  const SurfaceInfo& info = g.surfaces[s.surface];
  hit.reach = std::max(info.reach, reach_in_double(hit.p, s.radius));
  hit.ng = V3(n) * info.orientation;
  if (!info.wants_uv && !info.wants_tangent) {
    hit.shading = Frame(hit.ng);
    return true;
  }
  const auto* r = s.to_local;
  const V3d q = local_direction(s, n);
  hit.uv = uv_of(q);
  // The tangent points along increasing azimuth about the sphere's own z axis.
  const V3d dpdu(-q.y * r[0] + q.x * r[3], -q.y * r[1] + q.x * r[4], -q.y * r[2] + q.x * r[5]);
  hit.shading = Frame::from_tangent(hit.ng, V3(dpdu));
  if (info.wants_slopes) {
    const double sine = std::hypot(q.x, q.y), c = sine > 0 ? q.x / sine : 1, d = sine > 0 ? q.y / sine : 0;
    // dp/dtheta, where theta is the polar angle, in the sphere's axes
    const V3d along(q.z * c, q.z * d, -sine);
    const V3d dpdv(along.x * r[0] + along.y * r[3] + along.z * r[6],
                   along.x * r[1] + along.y * r[4] + along.z * r[7],
                   along.x * r[2] + along.y * r[5] + along.z * r[8]);
    hit.set_slopes(V3(dpdu * (2 * kPiD * s.radius)), V3(dpdv * (kPiD * s.radius)), g.scale);
  }
  return true;
}

bool complete_disk(const Geometry& g, std::uint32_t i, const V3d& o, const V3d& d, SurfaceHit& hit) {
  const Disk& s = g.disks[i];
  const double den = s.n.dot(d);
  if (den == 0) return false;
  const double t = s.n.dot(s.center - o) / den;
  if (!std::isfinite(t)) return false;
  hit.t = std::max(0.f, static_cast<float>(t));  // as in complete_triangle(): the BVH may round
  const V3d q = o + d * t - s.center;
  const double uu = s.u.dot(s.u), vv = s.v.dot(s.v), uv = s.u.dot(s.v), det = uu * vv - uv * uv;
  double a = (q.dot(s.u) * vv - q.dot(s.v) * uv) / det, b = (q.dot(s.v) * uu - q.dot(s.u) * uv) / det;
  if (const double r2 = a * a + b * b; r2 > 1) {
    a /= std::sqrt(r2);
    b /= std::sqrt(r2);
  }
  hit.p = V3(s.center + s.u * a + s.v * b);
  hit.reach = std::max(g.surfaces[s.surface].reach, reach_in_double(hit.p, std::sqrt(uu + vv)));
  hit.surface = s.surface;
  hit.ng = V3(s.n) * g.surfaces[s.surface].orientation;
  double angle = std::atan2(b, a);
  if (angle < 0) angle += 2 * kPiD;
  hit.uv = {static_cast<float>(std::sqrt(a * a + b * b)), static_cast<float>(angle) * kInvTwoPi};
  hit.shading = Frame::from_tangent(hit.ng, V3(s.u * a + s.v * b));
  if (g.surfaces[s.surface].wants_slopes) {
    const double radius = std::sqrt(a * a + b * b);
    const V3d radial = radius > 0 ? (s.u * a + s.v * b) / radius : s.u;
    hit.set_slopes(V3(radial), V3((s.v * a - s.u * b) * (2 * kPiD)), g.scale);
  }
  return true;
}

bool complete_cylinder(const Geometry& g, std::uint32_t i, const V3d& o, const V3d& d, SurfaceHit& hit) {
  const Cylinder& s = g.cylinders[i];
  const double t = intersect(s, o, d, 0, kInf);
  if (t == kInf) return false;
  hit.t = static_cast<float>(t);
  const V3d q = o + d * t - s.p0;
  const double x = q.dot(s.u), y = q.dot(s.v), l = std::sqrt(x * x + y * y);
  if (!(l > 0)) return false;
  const double z = std::clamp(q.dot(s.axis), 0., s.length);
  const V3d n = s.u * (x / l) + s.v * (y / l);
  hit.p = V3(s.p0 + s.axis * z + n * s.radius);
  hit.surface = s.surface;
  const SurfaceInfo& info = g.surfaces[s.surface];
  hit.reach = std::max(info.reach, reach_in_double(hit.p, s.length + s.radius));
  hit.ng = V3(n) * info.orientation;
  double angle = std::atan2(y, x);
  if (angle < 0) angle += 2 * kPiD;
  hit.uv = {static_cast<float>(angle) * kInvTwoPi, static_cast<float>(z / s.length)};
  const V3d along = s.v * (x / l) - s.u * (y / l);
  hit.shading = info.wants_tangent ? Frame::from_tangent(hit.ng, V3(along)) : Frame(hit.ng);
  if (info.wants_slopes) hit.set_slopes(V3(along * (2 * kPiD * s.radius)), V3(s.axis * s.length), g.scale);
  return true;
}

}  // namespace

V2 sphere_uv(const Sphere& s, const V3d& n) { return uv_of(local_direction(s, n)); }

namespace {

// True for a triangle outside of groups, the case of most hits. Both conditions are tested by one comparison.
bool is_usual(const PrimitiveId& id) {
  static_assert(PrimitiveId::Kind::triangle == PrimitiveId::Kind{0} && kNone == ~0u);
  return (static_cast<std::uint32_t>(id.kind) | ~id.instance) == 0;
}

}  // namespace

bool Geometry::complete(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const {
  if (!is_usual(id)) [[unlikely]]
    return complete_unusual(id, o, d, hit);
  hit.primitive = id;
  return complete_triangle(*this, id.index, o, d, hit);
}

bool Geometry::complete(PrimitiveId id, const V3& o, const V3& d, const Moment& moment,
                        SurfaceHit& hit) const {
  if (id.instance == kNone) return complete(id, o, d, hit);
  return complete_instanced(moment.placed(id.instance), id, o, d, hit);
}

PlacedInstance placed_at(const Geometry& geometry, std::uint32_t instance, double time) {
  PlacedInstance placed = geometry.instances[instance];
  if (placed.moving == kNone) return placed;
  placed.to_world = geometry.moving[placed.moving].to_world(time);
  placed.to_local = placed.to_world.inverse();
  return placed;
}

bool Geometry::complete_unusual(PrimitiveId id, const V3& o, const V3& d, SurfaceHit& hit) const {
  if (id.instance != kNone) return complete_instanced(instances[id.instance], id, o, d, hit);
  return complete_local(id, V3d(o), V3d(d), hit);
}

bool Geometry::complete_local(PrimitiveId id, const V3d& o, const V3d& d, SurfaceHit& hit) const {
  hit.primitive = id;
  switch (id.kind) {
    case PrimitiveId::Kind::triangle:
      return complete_triangle(*this, id.index, o, d, hit);
    case PrimitiveId::Kind::sphere:
      return complete_sphere(*this, id.index, o, d, hit);
    case PrimitiveId::Kind::disk:
      return complete_disk(*this, id.index, o, d, hit);
    case PrimitiveId::Kind::cylinder:
      return complete_cylinder(*this, id.index, o, d, hit);
  }
  return false;
}

namespace {

// Returns the reach (SurfaceHit::reach) in the world of a hit in the instance i. p is its position and ng its
// normal, and `local` is its reach in the group's space. The BVH transforms the ray to the group's space in
// single precision. Each component of the ray's origin is then a sum of four products, accurate to four ulps
// of the sum of their absolute values. offset_point() moves rays by 16 ulps of the reach, so the reach must
// be at least a quarter of that sum. In the world, an error in component k moves the hit off the surface by
// the error times |A^T ng|_k, where A is the matrix of the map to the world. An error of `local` in every
// component moves it by the sum over k of `local` times |A^T ng|_k.
float reach_of(const PlacedInstance& i, const V3& p, const V3& ng, float local) {
  const auto& a = i.to_world.a;
  const auto& b = i.to_local.a;
  const V3d q(std::abs(p.x), std::abs(p.y), std::abs(p.z));
  double across = 0, here = 0;
  for (int k = 0; k < 3; ++k) {
    const double share = std::abs(a[k] * ng.x + a[3 + k] * ng.y + a[6 + k] * ng.z);
    const double* row = &b[3 * static_cast<std::size_t>(k)];
    here += share * local;
    across += share * (std::abs(row[0]) * q.x + std::abs(row[1]) * q.y + std::abs(row[2]) * q.z +
                       std::abs(i.to_local.b[k]));
  }
  return std::max(largest(p), static_cast<float>(std::max(here, across / 4)));
}

}  // namespace

// The ray is transformed to the group's space without normalisation, so distances along it are the same in
// both spaces. Normals are transformed back by the matrix of cofactors, negated if the map mirrors: a
// positive multiple of the inverse transpose, so that normals keep their side of the surface.
bool Geometry::complete_instanced(const PlacedInstance& i, PrimitiveId id, const V3& o, const V3& d,
                                  SurfaceHit& hit) const {
  LS_COUNT(instances);
  if (!complete_local(id, i.to_local.point(V3d(o)), i.to_local.vector(V3d(d)), hit)) return false;
  const auto normal = [&](const V3& n) {
    return V3(i.to_world.normal(V3d(n)).normalized() * double{i.mirrored});
  };
  const auto vector = [&](const V3& v) { return V3(i.to_world.vector(V3d(v))); };
  const SurfaceInfo& info = surfaces[hit.surface];
  const Frame local = hit.shading;
  hit.p = V3(i.to_world.point(V3d(hit.p)));
  hit.ng = normal(hit.ng);
  hit.reach = std::max(surfaces[hit.surface].coincident_reach, render::reach_of(i, hit.p, hit.ng, hit.reach));
  const V3 ns = normal(local.n);
  hit.shading = info.wants_tangent ? Frame::from_tangent(ns, normalize(vector(local.s))) : Frame(ns);
  if (info.wants_slopes) hit.set_slopes(vector(local.to_world(hit.du)), vector(local.to_world(hit.dv)), 1);
  return true;
}

double intersect(const Sphere& s, const V3d& o, const V3d& d, double t_min, double t_max) {
  // Distances are computed relative to the point of the ray nearest to the centre, so that no digits cancel
  // for distant or grazing rays.
  const V3d f = o - s.center;
  const double a = d.dot(d), b = -f.dot(d), outside = f.dot(f) - s.radius * s.radius;
  if (b < 0 && outside > 0) return kInf;  // the sphere is behind the ray's origin
  const V3d foot = f + d * (b / a);
  const double disc = s.radius * s.radius - foot.dot(foot);
  if (!(disc >= 0)) return kInf;
  const double q = b + std::copysign(std::sqrt(a * disc), b);
  double t0 = q != 0 ? outside / q : 0, t1 = q / a;
  if (t0 > t1) std::swap(t0, t1);
  if (t0 > t_min && t0 < t_max) return t0;
  if (t1 > t_min && t1 < t_max) return t1;
  return kInf;
}

double intersect(const Disk& s, const V3d& o, const V3d& d, double t_min, double t_max) {
  const double den = s.n.dot(d);
  if (den == 0) return kInf;
  const double t = s.n.dot(s.center - o) / den;
  if (!(t > t_min && t < t_max)) return kInf;
  const V3d q = o + d * t - s.center;
  const double uu = s.u.dot(s.u), vv = s.v.dot(s.v), uv = s.u.dot(s.v), det = uu * vv - uv * uv;
  const double a = (q.dot(s.u) * vv - q.dot(s.v) * uv) / det, b = (q.dot(s.v) * uu - q.dot(s.u) * uv) / det;
  return a * a + b * b <= 1 ? t : kInf;
}

// Intersects in the plane perpendicular to the axis. As for spheres, distances are computed relative to the
// ray's point nearest to the axis. Both intersections are tried, because the cylinder has no caps.
double intersect(const Cylinder& s, const V3d& o, const V3d& d, double t_min, double t_max) {
  const V3d f = o - s.p0;
  const double dx = d.dot(s.u), dy = d.dot(s.v), dz = d.dot(s.axis);
  const double fx = f.dot(s.u), fy = f.dot(s.v), fz = f.dot(s.axis);
  const double a = dx * dx + dy * dy;
  if (!(a > 0)) return kInf;  // the ray is parallel to the axis
  const double b = -(fx * dx + fy * dy), nx = fx + dx * (b / a), ny = fy + dy * (b / a);
  const double disc = s.radius * s.radius - (nx * nx + ny * ny);
  if (!(disc >= 0)) return kInf;
  const double outside = fx * fx + fy * fy - s.radius * s.radius;
  const double q = b + std::copysign(std::sqrt(a * disc), b);
  double t0 = q != 0 ? outside / q : 0, t1 = q / a;
  if (t0 > t1) std::swap(t0, t1);
  for (const double t : {t0, t1}) {
    const double z = fz + dz * t;
    if (t > t_min && t < t_max && z >= 0 && z <= s.length) return t;
  }
  return kInf;
}

float Geometry::reach_of(std::uint32_t triangle) const {
  return std::max(largest(vertex(triangle, 0)),
                  std::max(largest(vertex(triangle, 1)), largest(vertex(triangle, 2))));
}

std::uint64_t Geometry::bytes() const {
  return positions.size() * sizeof(V3) + normals.size() * sizeof(V3) + uvs.size() * sizeof(V2) +
         indices.size() * sizeof(std::uint32_t) + triangle_surface.size() * sizeof(std::uint32_t) +
         spheres.size() * sizeof(Sphere) + disks.size() * sizeof(Disk) + cylinders.size() * sizeof(Cylinder) +
         instances.size() * sizeof(PlacedInstance) + attributes.bytes() +
         surfaces.size() * sizeof(SurfaceInfo);
}

}  // namespace ls::render
