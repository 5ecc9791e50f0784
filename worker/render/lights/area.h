// Area lights: shapes that emit light.
#pragma once

#include <variant>
#include <vector>

#include "worker/render/lights/light_kind.h"

namespace ls::render {

struct AreaPoint {  // a point on an area light, and the unit normal of the emitting side
  V3 p, n;
  V2 uv{0, 0};  // texture coordinates, used only for textured lights
  FacePoint face;
};

// The emission of an area light, for any shape.
struct AreaLight : LightKind {
  static constexpr bool kHasPlace = true, kIsArea = true;
  TextureIndex radiance;
  bool textured = false;
  bool beam = false;     // true if the radiance depends on the angle to the normal
  bool uniform = false;  // true if the light is neither textured nor a beam
  C3 value;              // the light's radiance if `uniform`
  // For a beam. The radiance is full if the cosine to the normal is at least cos_beam, and 0 if it is at most
  // cos_cutoff. Between them the radiance has the factor ((cosine - cos_cutoff) * inv_transition)^falloff,
  // where inv_transition is 1 / (cos_beam - cos_cutoff).
  float cos_cutoff = 0, cos_beam = 0, inv_transition = 0, falloff = 1;
  bool two_sided = false;  // true if the other side emits the same light
  float sign = 1;          // 1 if the shape emits where its own normals point, -1 if on the other side
  float reach = 1;         // largest absolute coordinate of the light's points; it bounds rounding errors
  double area = 0;

  void set_emission(const AreaEmitter& emitter, float orientation, const LightWorld& world);
  bool dark(const LightWorld& world) const { return !(area > 0) || is_black(world.textures.mean(radiance)); }
  double power(const LightWorld& world) const {
    return luminance(world.textures.mean(radiance)) * beam_flux() * area * (two_sided ? 2 : 1);
  }
  // The radiance at the texture coordinates `uv` of `face`, towards a viewer whose direction has the cosine
  // `cosine` > 0 to the normal.
  C3 emitted(const LightWorld& world, V2 uv, const FacePoint* face, float cosine) const {
    if (uniform) return value;
    const C3 varying = world.textures.eval(radiance, uv, face);
    return beam ? varying * beam_share(cosine) : varying;
  }
  // Returns the light that arrives at x from the point y. The sample's target is just in front of the light,
  // so that the shadow ray ends before the light.
  std::optional<LightSample> from_point(const LightWorld& world, const AreaPoint& y, const V3& x,
                                        float p) const;
  // The density, per steradian at x, with which sample() finds the point `hit`, which lies in the direction
  // `direction` from x, times p, the probability of choosing the light.
  float pdf(const LightWorld&, const SurfaceHit& hit, const V3& x, const V3& direction, float p) const {
    const V3 f = hit.p - x;
    const float cosine = std::abs(dot(direction, hit.ng));
    if (!(cosine > 0)) return 0;
    return static_cast<float>(dot(f, f) / (cosine * area)) * p;
  }
  static V3 pivot_of(const LightWorld&, const SurfaceHit& hit) { return hit.p; }

 protected:
  // Returns bounds with the box from middle - half to middle + half. Their cone of normals has all
  // directions.
  LightBounds bounds_of(const LightWorld& world, const V3& middle, const V3& half) const;
  // Sets the cone of the normals of the emitting side. If both sides emit, the normals point in all
  // directions, which is the default.
  void set_normals(const V3& axis, float cos_spread, LightBounds& b) const {
    if (two_sided) return;
    b.axis = axis;
    b.cos_spread = cos_spread;
  }
  // Sets the members of the bounds that follow from the emission: intensity and cos_reach.
  void set_emission_bounds(const LightWorld& world, LightBounds& b) const;
  float beam_share(float cosine) const {
    if (cosine >= cos_beam) return 1;
    if (!(cosine > cos_cutoff)) return 0;
    return std::pow((cosine - cos_cutoff) * inv_transition, falloff);
  }
  double beam_flux() const;  // flux per unit radiance and area; pi without a beam
};

// An area light that can sample a point on itself (Light::point) before the shaded point is known.
template <class Light>
struct SampledByPoint : AreaLight {
  V3 pivot(const LightWorld& world, const LightNumbers& numbers) const {
    return static_cast<const Light&>(*this).point(world, numbers).p;
  }
  std::optional<LightSample> sample(const LightWorld& world, const LightNumbers& numbers, const V3& x,
                                    float p) const {
    return from_point(world, static_cast<const Light&>(*this).point(world, numbers), x, p);
  }
};

struct ParallelogramLight : SampledByPoint<ParallelogramLight> {
  // Texture coordinates are (0, 0) at the corner, (1, 0) at the end of axis_u and (0, 1) at the end of
  // axis_v.
  V3 corner, axis_u, axis_v, normal;

  AreaPoint point(const LightWorld&, const LightNumbers& numbers) const {
    const V2 u = numbers.unit();
    AreaPoint y{corner + axis_u * u.x + axis_v * u.y, normal, {0, 0}, {}};
    if (textured) y.uv = u;
    return y;
  }
  LightBounds bounds(const LightWorld& world) const;
};

struct DiskLight : SampledByPoint<DiskLight> {
  V3 center, axis_u, axis_v, normal;

  AreaPoint point(const LightWorld&, const LightNumbers& numbers) const {
    const V2 q = concentric_disk(numbers.unit());
    float angle = std::atan2(q.y, q.x);
    if (angle < 0) angle += kTwoPi;
    return {center + axis_u * q.x + axis_v * q.y,
            normal,
            {std::sqrt(q.x * q.x + q.y * q.y), angle * kInvTwoPi},
            {}};
  }
  LightBounds bounds(const LightWorld& world) const;
};

struct CylinderLight : SampledByPoint<CylinderLight> {
  std::uint32_t primitive = 0;

  AreaPoint point(const LightWorld& world, const LightNumbers& numbers) const {
    const V2 u = numbers.unit();
    const Cylinder& c = world.geometry.cylinders[primitive];
    const V2 q = unit_circle(u.y);
    const V3d n = c.u * double{q.x} + c.v * double{q.y};
    return {V3(c.p0 + c.axis * (u.x * c.length) + n * c.radius), V3(n) * sign, {u.y, u.x}, {}};
  }
  LightBounds bounds(const LightWorld& world) const;
};

struct MeshLight : SampledByPoint<MeshLight> {
  std::uint32_t first = 0;  // index of the first triangle
  std::vector<double> cdf;  // for each triangle, the sum of the areas up to its end

  AreaPoint point(const LightWorld& world, const LightNumbers& numbers) const;
  LightBounds bounds(const LightWorld& world) const;
  std::uint64_t extra_bytes() const { return cdf.size() * sizeof(double); }
};

// A sphere is sampled by directions from the shaded point. The pivot (the point about which segments of paths
// are sampled) is needed before the shaded point is known, so it is the sphere's centre.
struct SphereLight : AreaLight {
  std::uint32_t primitive = 0;

  V3 pivot(const LightWorld& world, const LightNumbers&) const {
    return V3(world.geometry.spheres[primitive].center);
  }
  V3 pivot_of(const LightWorld& world, const SurfaceHit&) const { return pivot(world, {}); }
  std::optional<LightSample> sample(const LightWorld& world, const LightNumbers& numbers, const V3& x,
                                    float p) const;
  float pdf(const LightWorld& world, const SurfaceHit& hit, const V3& x, const V3& direction, float p) const;
  LightBounds bounds(const LightWorld& world) const;

 private:
  float side_of(const Sphere& s, const V3& x) const;
};

using AreaKinds = Kinds<ParallelogramLight, MeshLight, SphereLight, DiskLight, CylinderLight>;

// For each surface, the ranges of its primitives' indices in Geometry's lists. The primitives of a surface
// are contiguous in each list.
struct SurfacePrimitives {
  struct Range {
    std::uint32_t first = kNone, count = 0;
  };
  std::vector<Range> triangles, spheres, disks, cylinders;  // indexed by surface

  explicit SurfacePrimitives(const Geometry& geometry);
};

std::variant<ParallelogramLight, MeshLight, SphereLight, DiskLight, CylinderLight> make_area_light(
    const Shape& shape, std::uint32_t surface, const SurfacePrimitives& primitives, const LightWorld& world);

}  // namespace ls::render
