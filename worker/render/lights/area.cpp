#include "worker/render/lights/area.h"

namespace ls::render {
namespace {

V3 absolute(const V3& v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

// True if x is inside the sphere. Points on the surface, up to a few ulps of the largest coordinate `reach`,
// count as being on the side that emits (`sign`: 1 for the outer side, -1 for the inner one), so that
// sampling a direction and computing its density treat them in the same way.
bool is_inside(const Sphere& s, float reach, float sign, const V3& x) {
  const V3d f = s.center - V3d(x);
  const double margin = std::max(0., s.radius - double{sign} * 0x1p-20 * double{reach});
  return f.dot(f) < margin * margin;
}
// The cone of directions from x to the sphere's emitting side, as 1 - cos of its half angle, without
// cancellation (docs/measurements/stability.md N26). The value is 2 (all directions) if the inner side emits
// and x is inside, and 0 (none) if x cannot see the emitting side.
float one_minus_cos(const Sphere& s, float reach, float sign, const V3& x) {
  const V3d f = s.center - V3d(x);
  const double d2 = f.dot(f);
  const bool inside = is_inside(s, reach, sign, x);
  if (inside != (sign < 0)) return 0;
  if (inside) return 2;
  const double sin2 = std::min(1., s.radius * s.radius / d2);
  return static_cast<float>(sin2 / (1 + std::sqrt(1 - sin2)));
}

}  // namespace

void AreaLight::set_emission(const AreaEmitter& e, float orientation, const LightWorld& world) {
  radiance = e.radiance;
  textured = !world.textures.is_constant(radiance);
  sign = orientation;
  two_sided = e.two_sided;
  beam = e.beam_width < 90;
  if (beam) {
    const double cutoff = std::cos(e.cutoff_angle * (kPiD / 180)),
                 full = std::cos(e.beam_width * (kPiD / 180));
    cos_cutoff = static_cast<float>(e.cutoff_angle < 90 ? cutoff : 0);
    cos_beam = static_cast<float>(full);
    inv_transition = cos_beam > cos_cutoff ? 1 / (cos_beam - cos_cutoff) : 0.f;
    falloff = static_cast<float>(e.falloff);
  }
  uniform = !textured && !beam;
  if (uniform) value = world.textures.constant(radiance);
}

// The flux of a beam per unit radiance and area is 2 pi times the integral of beam_share(c) c dc over the
// cosine c to the normal. beam_share is 0 below the cosine `cutoff` and 1 above the cosine `beam`. Between
// them it is s^p, where p is the falloff, s = (c - cutoff) / w and w = beam - cutoff. With c = cutoff + w s
// the integral is
//   w integral_0^1 s^p (cutoff + w s) ds + (1 - beam^2) / 2.
double AreaLight::beam_flux() const {
  if (!beam) return kPiD;
  const double cutoff = cos_cutoff, full = cos_beam, w = full - cutoff, p = falloff;
  return 2 * kPiD * (w * (cutoff / (p + 1) + w / (p + 2)) + (1 - full * full) / 2);
}

std::optional<LightSample> AreaLight::from_point(const LightWorld& world, const AreaPoint& y, const V3& x,
                                                 float p) const {
  const V3 n = two_sided && dot(x - y.p, y.n) < 0 ? -y.n : y.n;
  const V3 target = offset_target(y.p, n, reach, x, n);
  const V3 f = target - x;
  const float d2 = dot(f, f);
  if (!(d2 > 0)) return std::nullopt;
  const float d = std::sqrt(d2);
  LightSample s;
  s.direction = f / d;
  s.distance = d;
  s.target = target;
  const float cosine = -dot(s.direction, n);
  if (!(cosine > 0)) return std::nullopt;
  s.radiance = emitted(world, y.uv, &y.face, cosine);
  if (beam && is_black(s.radiance)) return std::nullopt;
  s.pdf = static_cast<float>(d2 / (cosine * area)) * p;
  if (!std::isfinite(s.pdf)) return std::nullopt;
  return s;
}

void AreaLight::set_emission_bounds(const LightWorld& world, LightBounds& b) const {
  b.intensity = luminance(world.textures.mean(radiance) * static_cast<float>(area));
  if (beam) b.cos_reach = cos_cutoff;
}

LightBounds AreaLight::bounds_of(const LightWorld& world, const V3& middle, const V3& half) const {
  LightBounds b;
  b.low = middle - half, b.high = middle + half;
  set_emission_bounds(world, b);
  return b;
}

LightBounds ParallelogramLight::bounds(const LightWorld& world) const {
  LightBounds b =
      bounds_of(world, corner + (axis_u + axis_v) * .5f, (absolute(axis_u) + absolute(axis_v)) * .5f);
  set_normals(normal, 1, b);
  return b;
}

LightBounds DiskLight::bounds(const LightWorld& world) const {
  LightBounds b = bounds_of(world, center, absolute(axis_u) + absolute(axis_v));
  set_normals(normal, 1, b);
  return b;
}

LightBounds CylinderLight::bounds(const LightWorld& world) const {
  const Cylinder& c = world.geometry.cylinders[primitive];
  return bounds_of(
      world, V3(c.p0 + c.axis * (c.length / 2)),
      absolute(V3(c.axis * (c.length / 2))) + absolute(V3(c.u * c.radius)) + absolute(V3(c.v * c.radius)));
}

LightBounds SphereLight::bounds(const LightWorld& world) const {
  const Sphere& s = world.geometry.spheres[primitive];
  return bounds_of(world, V3(s.center), V3(static_cast<float>(s.radius)));
}

LightBounds MeshLight::bounds(const LightWorld& world) const {
  const Geometry& g = world.geometry;
  LightBounds b;
  set_emission_bounds(world, b);
  b.low = V3(kInfinity);
  b.high = V3(-kInfinity);
  const auto triangles = static_cast<std::uint32_t>(cdf.size());
  const auto normal = [&](std::uint32_t k) {
    const V3d v0(g.vertex(first + k, 0));
    return (V3d(g.vertex(first + k, 1)) - v0).cross(V3d(g.vertex(first + k, 2)) - v0);
  };
  V3d sum(0, 0, 0);
  for (std::uint32_t k = 0; k < triangles; ++k) {
    sum += normal(k);
    for (int corner = 0; corner < 3; ++corner) {
      const V3 p = g.vertex(first + k, corner);
      for (int c = 0; c < 3; ++c) b.low[c] = std::min(b.low[c], p[c]), b.high[c] = std::max(b.high[c], p[c]);
    }
  }
  if (!(sum.length() > 0)) return b;
  const V3d axis = sum.normalized();
  double spread = 1;
  for (std::uint32_t k = 0; k < triangles; ++k) spread = std::min(spread, axis.dot(normal(k).normalized()));
  set_normals(V3(axis) * sign, static_cast<float>(std::max(-1., spread)), b);
  return b;
}

// numbers.x chooses the triangle, in proportion to area. The place of numbers.x in the interval of numbers
// that choose this triangle is used as a random number for the point on it.
AreaPoint MeshLight::point(const LightWorld& world, const LightNumbers& numbers) const {
  const Geometry& g = world.geometry;
  const double target = (numbers.x + .5) * 0x1p-32 * cdf.back();
  const auto it = std::upper_bound(cdf.begin(), cdf.end() - 1, target);
  const auto k = static_cast<std::uint32_t>(it - cdf.begin());
  const double before = k ? cdf[k - 1] : 0, width = cdf[k] - before;
  const auto r = static_cast<float>(std::clamp((target - before) / width, 0., 1.));
  const float root = std::sqrt(r), b0 = 1 - root, b1 = unit_float(numbers.y) * root, b2 = 1 - b0 - b1;
  const std::uint32_t tri = first + k, *idx = &g.indices[std::size_t{3} * tri];
  const V3 v0 = g.positions[idx[0]], v1 = g.positions[idx[1]], v2 = g.positions[idx[2]];
  AreaPoint y;
  y.p = v0 * b0 + v1 * b1 + v2 * b2;
  // The normal is computed in double, because the square of a small triangle's area underflows in float32.
  const V3d n = V3d(v1 - v0).cross(V3d(v2 - v0));
  y.n = V3(n * (sign / n.length()));
  y.uv = {b1, b2};
  y.face = {g.triangle_surface[tri], tri, b1, b2};
  if (!g.uvs.empty() && g.surfaces[g.triangle_surface[tri]].uvs)
    y.uv = g.uvs[idx[0]] * b0 + g.uvs[idx[1]] * b1 + g.uvs[idx[2]] * b2;
  return y;
}

// Returns the side of the sphere whose light arrives at x: 1 for the outer side, -1 for the inner one. If
// both sides shine, a point on the surface counts as inside: because the sphere is convex, such a point sees
// the inner side and not the outer one.
float SphereLight::side_of(const Sphere& s, const V3& x) const {
  if (!two_sided) return sign;
  return is_inside(s, reach, -1, x) ? -1.f : 1.f;
}

std::optional<LightSample> SphereLight::sample(const LightWorld& world, const LightNumbers& numbers,
                                               const V3& x, float p) const {
  const Sphere& sphere = world.geometry.spheres[primitive];
  const V2 u = numbers.unit();
  const float side = side_of(sphere, x), cone = one_minus_cos(sphere, reach, side, x);
  if (!(cone > 0)) return std::nullopt;
  const V3 axis = normalize(V3(sphere.center - V3d(x)));
  const float one_minus = cone * u.x, cosine = 1 - one_minus;
  const float sine = std::sqrt(std::max(0.f, one_minus * (2 - one_minus)));
  const float angle = kTwoPi * u.y;
  LightSample s;
  const Frame frame = dot(axis, axis) > 0 ? Frame(axis) : Frame(V3(0, 0, 1));
  s.direction = normalize(frame.to_world({sine * std::cos(angle), sine * std::sin(angle), cosine}));
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  double t = intersect(sphere, V3d(x), V3d(s.direction), 0, kEndless);
  if (side < 0) {
    // If x is inside, the ray ends at the far wall of the sphere, even if rounding has put x just outside of
    // the near wall.
    const double far = intersect(sphere, V3d(x), V3d(s.direction), t, kEndless);
    if (std::isfinite(far)) t = far;
  }
  // At the rim of the sphere the ray may miss the sphere by rounding. The point of the ray nearest to the
  // sphere is then used.
  const double along = std::isfinite(t) ? t : std::max(0., (sphere.center - V3d(x)).dot(V3d(s.direction)));
  const V3d n = (V3d(x) + V3d(s.direction) * along - sphere.center).normalized();
  const V3 y(sphere.center + n * sphere.radius);
  const V3 target = offset_target(y, V3(n), reach, x, V3(n) * side), f = target - x;
  s.distance = std::sqrt(dot(f, f));
  s.target = target;
  s.pdf = p / (kTwoPi * cone);
  const float facing = beam ? -side * dot(V3(n), s.direction) : 1.f;
  s.radiance = emitted(world, textured ? sphere_uv(sphere, n) : V2(0, 0), nullptr, facing);
  if (!(s.distance > 0) || !std::isfinite(s.pdf) || (beam && is_black(s.radiance))) return std::nullopt;
  return s;
}

float SphereLight::pdf(const LightWorld& world, const SurfaceHit& hit, const V3& x, const V3& direction,
                       float p) const {
  const Sphere& sphere = world.geometry.spheres[primitive];
  const float side = side_of(sphere, x);
  // If the sphere lets light through, a ray may pass its near wall and hit the far wall from inside. sample()
  // finds only points on the side that x sees, so the density of such a hit is 0.
  if (two_sided && dot(direction, hit.ng) * sign * side > 0) return 0;
  const float cone = one_minus_cos(sphere, reach, side, x);
  return cone > 0 ? p / (kTwoPi * cone) : 0;
}

SurfacePrimitives::SurfacePrimitives(const Geometry& g) {
  for (auto* ranges : {&triangles, &spheres, &disks, &cylinders}) ranges->resize(g.surfaces.size());
  const auto add = [](Range& r, std::size_t i) {
    if (r.count++ == 0) r.first = static_cast<std::uint32_t>(i);
  };
  for (std::size_t i = 0; i < g.triangle_surface.size(); ++i) add(triangles[g.triangle_surface[i]], i);
  for (std::size_t i = 0; i < g.spheres.size(); ++i) add(spheres[g.spheres[i].surface], i);
  for (std::size_t i = 0; i < g.disks.size(); ++i) add(disks[g.disks[i].surface], i);
  for (std::size_t i = 0; i < g.cylinders.size(); ++i) add(cylinders[g.cylinders[i].surface], i);
}

std::variant<ParallelogramLight, MeshLight, SphereLight, DiskLight, CylinderLight> make_area_light(
    const Shape& shape, std::uint32_t surface, const SurfacePrimitives& primitives, const LightWorld& world) {
  const Geometry& g = world.geometry;
  const auto triangles = primitives.triangles[surface], spheres = primitives.spheres[surface],
             disks = primitives.disks[surface], cylinders = primitives.cylinders[surface];
  // Sets the members of the light l that do not depend on its shape, and returns l.
  const auto shining = [&](auto l) {
    l.set_emission(*shape.emitter, g.surfaces[surface].orientation, world);
    return l;
  };
  if (spheres.count > 0) {
    auto l = shining(SphereLight{});
    l.primitive = spheres.first;
    l.area = 4 * kPiD * sqr(g.spheres[l.primitive].radius);
    return l;
  }
  if (cylinders.count > 0) {
    auto l = shining(CylinderLight{});
    l.primitive = cylinders.first;
    const Cylinder& c = g.cylinders[l.primitive];
    l.area = 2 * kPiD * c.radius * c.length;
    return l;
  }
  if (disks.count > 0) {
    auto l = shining(DiskLight{});
    const Disk& d = g.disks[disks.first];
    l.center = V3(d.center);
    l.axis_u = V3(d.u);
    l.axis_v = V3(d.v);
    l.normal = V3(d.n) * l.sign;
    l.area = kPiD * d.u.cross(d.v).length();
    return l;
  }
  if (std::holds_alternative<RectangleShape>(shape.geometry) && triangles.count == 2) {
    auto l = shining(ParallelogramLight{});
    const std::uint32_t* idx =
        &g.indices[std::size_t{3} * triangles.first];  // corners 0, 1, 2 of the rectangle
    const V3 a = g.positions[idx[0]], b = g.positions[idx[1]], c = g.positions[idx[2]];
    l.corner = a;
    l.axis_u = b - a;
    l.axis_v = c - b;
    const V3d n = V3d(l.axis_u).cross(V3d(l.axis_v));
    l.area = n.length();
    l.normal = V3(n / l.area) * l.sign;
    return l;
  }
  auto l = shining(MeshLight{});
  l.first = triangles.first;
  for (std::uint32_t n = 0; n < triangles.count; ++n) {
    const std::uint32_t i = triangles.first + n;
    const V3d e1 = V3d(g.vertex(i, 1)) - V3d(g.vertex(i, 0)), e2 = V3d(g.vertex(i, 2)) - V3d(g.vertex(i, 0));
    l.area += e1.cross(e2).length() / 2;
    l.cdf.push_back(l.area);
  }
  return l;
}

}  // namespace ls::render
