// Lights with a position but without extent.
#pragma once

#include "core/scene/analysis/camera_view.h"
#include "worker/render/lights/light_kind.h"
#include "worker/render/math/equal_area.h"

namespace ls::render {

// A light with a position but without extent. Light::towards(world, w) gives its intensity in the direction
// w, a unit vector from the light.
template <class Light>
struct Punctual : LightKind {
  static constexpr bool kHasPlace = true, kIsPoint = true;
  V3 position;

  V3 pivot(const LightWorld&, const LightNumbers&) const { return position; }
  std::optional<LightSample> sample(const LightWorld& world, const LightNumbers&, const V3& x,
                                    float p) const {
    const V3 f = position - x;
    const float d2 = dot(f, f);
    if (!(d2 > 0)) return std::nullopt;
    LightSample s;
    s.distance = std::sqrt(d2);
    s.direction = f / s.distance;
    s.target = position;
    s.radiance = static_cast<const Light&>(*this).towards(world, -s.direction) / d2;
    s.pdf = p;
    s.delta = true;
    if (is_black(s.radiance) || !is_finite(s.radiance)) return std::nullopt;
    return s;
  }

 protected:
  // Returns the bounds of a point that emits in all directions.
  LightBounds bounds_of(const C3& intensity) const {
    LightBounds b;
    b.low = b.high = position;
    b.intensity = luminance(intensity);
    return b;
  }
};

struct PointLight : Punctual<PointLight> {
  C3 intensity;

  bool dark(const LightWorld&) const { return is_black(intensity); }
  double power(const LightWorld&) const { return luminance(intensity) * 4 * kPiD; }
  LightBounds bounds(const LightWorld&) const { return bounds_of(intensity); }
  C3 towards(const LightWorld&, const V3&) const { return intensity; }
};

struct SpotLight : Punctual<SpotLight> {
  C3 intensity;
  V3 axis_u, axis_v, axis;
  float cos_cutoff = 0, cos_beam = 0, cutoff = 0, inv_transition = 0, tan_cutoff = 0;
  std::optional<TextureIndex> texture;  // the projected image

  Pivot pivot(const LightWorld&, const LightNumbers&) const { return {position, axis, cos_cutoff}; }
  bool dark(const LightWorld&) const { return is_black(intensity); }
  double power(const LightWorld&) const {
    return luminance(intensity) * 2 * kPiD * (1 - .5 * (cos_cutoff + cos_beam));
  }
  LightBounds bounds(const LightWorld&) const {
    LightBounds b = bounds_of(intensity);
    const float sine = safe_sqrt(1 - cos_beam * cos_beam) * safe_sqrt(1 - cos_cutoff * cos_cutoff);
    b.axis = axis;
    b.cos_spread = cos_beam;
    b.cos_reach = cos_beam * cos_cutoff + sine;
    return b;
  }
  C3 towards(const LightWorld& world, const V3& w) const {
    const float z = dot(w, axis);
    if (z <= cos_cutoff) return {0, 0, 0};
    C3 value = intensity;
    if (z < cos_beam) value *= (cutoff - std::acos(std::min(z, 1.f))) * inv_transition;
    if (texture) {
      const float k = .5f / (z * tan_cutoff);
      value *= world.textures.eval(*texture, {.5f + dot(w, axis_u) * k, .5f + dot(w, axis_v) * k});
    }
    return value;
  }
};

struct ProjectorLight : Punctual<ProjectorLight> {
  // For a texel value of 1: the irradiance on the plane at distance 1 from the light or, if `even` is set,
  // the intensity.
  C3 value;
  bool even = false;
  TextureIndex image;
  V3 axis_u, axis_v, axis;
  float tan_x = 0, tan_y = 0;  // tangents of half the field of view in x and in y

  // The cosine of the angle between the axis and the corners of the image.
  float cos_corner() const { return 1 / std::sqrt(1 + tan_x * tan_x + tan_y * tan_y); }
  Pivot pivot(const LightWorld&, const LightNumbers&) const { return {position, axis, cos_corner()}; }
  bool dark(const LightWorld& world) const { return is_black(value) || is_black(world.textures.mean(image)); }
  double power(const LightWorld& world) const {
    return luminance(value * world.textures.mean(image)) * (even ? solid_angle() : area());
  }
  // The image's area on the plane at distance 1, and the solid angle that it covers.
  double area() const { return double{4 * tan_x * tan_y}; }
  double solid_angle() const {
    const double x2 = tan_x * tan_x, y2 = tan_y * tan_y;
    return 4 * std::asin(std::sqrt(x2 * y2 / ((1 + x2) * (1 + y2))));
  }
  LightBounds bounds(const LightWorld& world) const {
    LightBounds b = bounds_of(value * world.textures.mean(image));
    // The mean intensity over all directions of the image is used: towards the corners of a wide image the
    // intensity is far higher than along the axis (see towards()).
    if (!even) b.intensity *= area() / solid_angle();
    b.axis = axis;
    b.cos_spread = cos_corner();
    b.cos_reach = 1;
    return b;
  }
  // The image is projected on the plane at distance 1 along the axis, where the irradiance is `value` times
  // the image at every angle. A ray at the cosine c to the axis meets this plane at distance 1 / c and at the
  // same cosine, so the intensity is value / c^3.
  C3 towards(const LightWorld& world, const V3& w) const {
    const float z = dot(w, axis);
    if (!(z > 0)) return {0, 0, 0};
    const float x = dot(w, axis_u) / (z * tan_x), y = dot(w, axis_v) / (z * tan_y);
    if (!(std::abs(x) <= 1) || !(std::abs(y) <= 1)) return {0, 0, 0};
    // As for cameras, x points to the left and y up, and uv is measured from the upper left corner of the
    // image.
    const C3 v = value * world.textures.eval(image, {.5f - .5f * x, .5f - .5f * y});
    return even ? v : v / (z * z * z);
  }
};

struct GoniometricLight : Punctual<GoniometricLight> {
  C3 intensity;
  V3 axis_u, axis_v, axis;
  TextureIndex image;

  // Equal areas of the image are equal solid angles, so the mean of its texels is the mean over all
  // directions.
  C3 mean_intensity(const LightWorld& world) const { return intensity * world.textures.mean(image); }

  bool dark(const LightWorld& world) const { return is_black(mean_intensity(world)); }
  double power(const LightWorld& world) const { return luminance(mean_intensity(world)) * 4 * kPiD; }
  LightBounds bounds(const LightWorld& world) const { return bounds_of(mean_intensity(world)); }
  C3 towards(const LightWorld& world, const V3& w) const {
    const V2 at = equal_area_place({dot(w, axis_u), dot(w, axis_v), dot(w, axis)});
    return intensity * world.textures.eval(image, at);
  }
};

using PunctualKinds = Kinds<PointLight, SpotLight, ProjectorLight, GoniometricLight>;

inline PointLight make_light(const PointEmitter& e, const LightWorld& world) {
  PointLight l;
  l.position = world.place({e.position[0], e.position[1], e.position[2]});
  l.intensity = color(e.intensity) * static_cast<float>(world.scale2());
  return l;
}

template <class Light>
void set_axes(Light& l, const Transform& to_world, const LightWorld& world) {
  const Affine m(to_world);
  l.position = world.place(m.b);
  l.axis_u = V3(m.vector({1, 0, 0}).normalized());
  l.axis_v = V3(m.vector({0, 1, 0}).normalized());
  l.axis = V3(m.vector({0, 0, 1}).normalized());
}

inline SpotLight make_light(const SpotEmitter& e, const LightWorld& world) {
  SpotLight l;
  set_axes(l, e.to_world, world);
  l.intensity = color(e.intensity) * static_cast<float>(world.scale2());
  const double rad = kPiD / 180, cutoff = e.cutoff_angle * rad, beam = e.beam_width * rad;
  l.cutoff = static_cast<float>(cutoff);
  l.cos_cutoff = static_cast<float>(std::cos(cutoff));
  l.cos_beam = static_cast<float>(std::cos(beam));
  l.inv_transition = cutoff > beam ? static_cast<float>(1 / (cutoff - beam)) : 0.f;
  l.tan_cutoff = static_cast<float>(std::tan(cutoff));
  l.texture = e.texture;
  return l;
}

inline ProjectorLight make_light(const ProjectorEmitter& e, const LightWorld& world) {
  ProjectorLight l;
  set_axes(l, e.to_world, world);
  l.image = e.irradiance;
  const double s = world.geometry.scale;
  l.value = C3(static_cast<float>((e.as_intensity ? 1 : kPiD) * e.scale * s * s));
  l.even = e.as_intensity;
  const double aspect = world.textures.aspect(e.irradiance),
               tan_x = scene::tan_half_fov_x(e.fov, e.fov_axis, aspect);
  l.tan_x = static_cast<float>(tan_x);
  l.tan_y = static_cast<float>(tan_x / aspect);
  return l;
}

inline GoniometricLight make_light(const GoniometricEmitter& e, const LightWorld& world) {
  GoniometricLight l;
  set_axes(l, e.to_world, world);
  l.intensity = color(e.intensity) * static_cast<float>(world.scale2());
  l.image = e.texture;
  return l;
}

}  // namespace ls::render
