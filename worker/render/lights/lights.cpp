#include "worker/render/lights/lights.h"

#include <algorithm>
#include <cmath>

#include "worker/render/media/medium.h"

namespace ls::render {
namespace {

// The cone of directions from x to the sphere's emitting side, as 1 - cos of its half angle, without
// cancellation (docs/measurements/stability.md N26). The value 2 means all directions, for an inner side seen
// from inside; 0 means none, where the emitting side faces away. Points on the surface itself, accurate to a
// few ulps of their coordinates, count as being on the emitting side: sampling and density must agree on
// them.
float one_minus_cos(const Sphere& s, float reach, float sign, const V3& x) {
  const V3d f = s.center - V3d(x);
  const double d2 = f.dot(f), margin = std::max(0., s.radius - sign * 0x1p-20 * reach);
  const bool inside = d2 < margin * margin;
  if (inside != (sign < 0)) return 0;
  if (inside) return 2;
  const double sin2 = std::min(1., s.radius * s.radius / d2);
  return static_cast<float>(sin2 / (1 + std::sqrt(1 - sin2)));
}

}  // namespace

std::vector<V3> Lights::points() const {
  std::vector<const Light*> found;
  for (const Light& l : lights_)
    if (is_point(l.kind)) found.push_back(&l);
  std::stable_sort(found.begin(), found.end(),
                   [&](const Light* a, const Light* b) { return power(*a, 1) > power(*b, 1); });
  std::vector<V3> list;
  for (const Light* l : found) list.push_back(l->position);
  return list;
}

bool Lights::any_without_place() const {
  return std::any_of(lights_.begin(), lights_.end(), [](const Light& l) { return !has_place(l.kind); });
}

V3 Lights::pivot(const LightChoice& choice) const {
  const Light& l = lights_[choice.light];
  if (choice.is_point) return l.position;
  if (l.kind == Kind::sphere) return V3(geometry_->spheres[l.primitive].center);
  return area_point(l, choice.numbers).p;
}

Lights::Point Lights::area_point(const Light& l, const LightNumbers& numbers) const {
  if (l.kind == Kind::mesh) return mesh_point(l, numbers);
  const V2 u(unit_float(numbers.x), unit_float(numbers.y));
  if (l.kind == Kind::cylinder) return cylinder_point(l, u);
  if (l.kind == Kind::parallelogram) {
    Point y{l.position + l.axis_u * u.x + l.axis_v * u.y, l.normal, {0, 0}, {}};
    if (l.textured) y.uv = l.uv0 + l.uv_u * u.x + l.uv_v * u.y;
    return y;
  }
  const V2 q = concentric_disk(u);
  float angle = std::atan2(q.y, q.x);
  if (angle < 0) angle += kTwoPi;
  return {l.position + l.axis_u * q.x + l.axis_v * q.y,
          l.normal,
          {std::sqrt(q.x * q.x + q.y * q.y), angle * kInvTwoPi},
          {}};
}

Lights::Point Lights::cylinder_point(const Light& l, V2 u) const {
  const Cylinder& c = geometry_->cylinders[l.primitive];
  const V2 q = unit_circle(u.y);
  const V3d n = c.u * double{q.x} + c.v * double{q.y};
  return {V3(c.p0 + c.axis * (u.x * c.length) + n * c.radius), V3(n) * l.sign, {u.y, u.x}, {}};
}

// Samples a point on a mesh. numbers.x chooses the triangle and is then rescaled to be used again for the
// point.
Lights::Point Lights::mesh_point(const Light& l, const LightNumbers& numbers) const {
  const double target = (numbers.x + .5) * 0x1p-32 * l.cdf.back();
  const auto it = std::upper_bound(l.cdf.begin(), l.cdf.end() - 1, target);
  const auto k = static_cast<std::uint32_t>(it - l.cdf.begin());
  const double before = k ? l.cdf[k - 1] : 0, width = l.cdf[k] - before;
  const auto r = static_cast<float>(std::clamp((target - before) / width, 0., 1.));
  const float root = std::sqrt(r), b0 = 1 - root, b1 = unit_float(numbers.y) * root, b2 = 1 - b0 - b1;
  const std::uint32_t tri = l.primitive + k, *idx = &geometry_->indices[std::size_t{3} * tri];
  const V3 v0 = geometry_->positions[idx[0]], v1 = geometry_->positions[idx[1]],
           v2 = geometry_->positions[idx[2]];
  Point y;
  y.p = v0 * b0 + v1 * b1 + v2 * b2;
  // The normal is computed in double, because the square of a small triangle's area underflows in float32.
  const V3d n = V3d(v1 - v0).cross(V3d(v2 - v0));
  y.n = V3(n * (l.sign / n.length()));
  y.uv = {b1, b2};
  y.face = {geometry_->triangle_surface[tri], tri, b1, b2};
  if (!geometry_->uvs.empty() && geometry_->surfaces[geometry_->triangle_surface[tri]].uvs) {
    y.uv = geometry_->uvs[idx[0]] * b0 + geometry_->uvs[idx[1]] * b1 + geometry_->uvs[idx[2]] * b2;
  }
  return y;
}

std::optional<LightSample> Lights::sample_area(const Light& l, const Point& y, const V3& x, float p) const {
  // `target` lies just in front of the light, so that the shadow ray ends before it.
  const V3 target = offset_point(y.p, y.n, l.reach, y.n);
  const V3 f = target - x;
  const float d2 = dot(f, f);
  if (!(d2 > 0)) return std::nullopt;
  const float d = std::sqrt(d2);
  LightSample s;
  s.direction = f / d;
  s.distance = d;
  s.target = target;
  const float cosine = -dot(s.direction, y.n);
  if (!(cosine > 0)) return std::nullopt;
  s.radiance = area_radiance(l, y.uv, &y.face, cosine);
  if (l.beam && is_black(s.radiance)) return std::nullopt;
  s.pdf = static_cast<float>(d2 / (cosine * l.area)) * p;
  if (!std::isfinite(s.pdf)) return std::nullopt;
  return s;
}

std::optional<LightSample> Lights::sample_sphere(const Light& l, V2 u, const V3& x, float p) const {
  const Sphere& sphere = geometry_->spheres[l.primitive];
  const float cone = one_minus_cos(sphere, l.reach, l.sign, x);
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
  if (l.sign < 0) {
    // Seen from inside, the ray ends at the far wall of the sphere, also if x lies on the near wall and
    // rounding put it just outside.
    const double far = intersect(sphere, V3d(x), V3d(s.direction), t, kEndless);
    if (std::isfinite(far)) t = far;
  }
  // At the rim of the sphere the ray may miss it by rounding; then the point of the ray nearest to the sphere
  // is used.
  const double reach = std::isfinite(t) ? t : std::max(0., (sphere.center - V3d(x)).dot(V3d(s.direction)));
  const V3d n = (V3d(x) + V3d(s.direction) * reach - sphere.center).normalized();
  const V3 y(sphere.center + n * sphere.radius);
  const V3 target = offset_point(y, V3(n), l.reach, V3(n) * l.sign), f = target - x;
  s.distance = std::sqrt(dot(f, f));
  s.target = target;
  s.pdf = p / (kTwoPi * cone);
  const float facing = l.beam ? -l.sign * dot(V3(n), s.direction) : 1.f;
  s.radiance = area_radiance(l, l.textured ? sphere_uv(sphere, n) : V2(0, 0), nullptr, facing);
  if (!(s.distance > 0) || !std::isfinite(s.pdf) || (l.beam && is_black(s.radiance))) return std::nullopt;
  return s;
}

// Samples the environment map. Its radiance and density are evaluated in the sampled direction itself, as for
// paths that leave the scene, so that both use the same density.
std::optional<LightSample> Lights::sample_map(const LightNumbers& numbers) const {
  const V3 direction = map_->sample(numbers.x, numbers.y);
  const EnvironmentMap::Light light = map_->at(direction);
  const float pdf = light.pdf * map_probability_;
  if (!(pdf > 0) || !std::isfinite(pdf)) return std::nullopt;
  return LightSample{direction, kInfinity, V3(0), light.radiance, pdf, false};
}

std::optional<LightSample> Lights::sample(const LightChoice& c, const V3& x) const {
  const Light& l = lights_[c.light];
  switch (l.kind) {
    case Kind::parallelogram:
    case Kind::mesh:
    case Kind::disk:
    case Kind::cylinder:
      return sample_area(l, area_point(l, c.numbers), x, c.probability);
    case Kind::sphere:
      return sample_sphere(l, {unit_float(c.numbers.x), unit_float(c.numbers.y)}, x, c.probability);
    case Kind::directional: {
      return LightSample{-l.normal, kInfinity, V3(0), l.value, l.probability, true};
    }
    case Kind::sun:
      return sample_sun(l, {unit_float(c.numbers.x), unit_float(c.numbers.y)});
    case Kind::map:
      return sample_map(c.numbers);
    case Kind::point:
    case Kind::spot:
    case Kind::projector:
      break;
  }
  const V3 f = l.position - x;
  const float d2 = dot(f, f);
  if (!(d2 > 0)) return std::nullopt;
  LightSample s;
  s.distance = std::sqrt(d2);
  s.direction = f / s.distance;
  s.target = l.position;
  if (l.kind == Kind::projector)
    s.radiance = projected(l, -s.direction) / d2;
  else
    s.radiance = (l.kind == Kind::spot ? spot_radiance(l, -s.direction) : l.value) / d2;
  s.pdf = c.probability;
  s.delta = true;
  if (is_black(s.radiance) || !is_finite(s.radiance)) return std::nullopt;
  return s;
}

C3 Lights::emitted(const SurfaceHit& hit, const V3& w) const {
  const std::uint32_t i = geometry_->surfaces[hit.surface].light;
  if (i == kNone || !(dot(hit.ng, w) > 0)) return {0, 0, 0};
  return area_radiance(lights_[i],
                       lights_[i].kind == Kind::sphere && !lights_[i].textured ? V2(0, 0) : hit.uv, &hit.face,
                       dot(hit.ng, w));
}

float Lights::pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const V3& n) const {
  const std::uint32_t light = geometry_->surfaces[hit.surface].light;
  const Light& l = lights_[light];
  const float p = by_tree(n) ? probability_at(light, x, n) : l.probability;
  if (l.kind == Kind::sphere) {
    const float cone = one_minus_cos(geometry_->spheres[l.primitive], l.reach, l.sign, x);
    return cone > 0 ? p / (kTwoPi * cone) : 0;
  }
  const V3 f = hit.p - x;
  const float cosine = std::abs(dot(direction, hit.ng));
  if (!(cosine > 0)) return 0;
  return static_cast<float>(dot(f, f) / (cosine * l.area)) * p;
}

V3 Lights::pivot(const SurfaceHit& hit) const {
  const Light& l = lights_[geometry_->surfaces[hit.surface].light];
  return l.kind == Kind::sphere ? V3(geometry_->spheres[l.primitive].center) : hit.p;
}

}  // namespace ls::render
