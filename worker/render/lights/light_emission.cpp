// The light that each kind of light emits, by direction.
#include <algorithm>
#include <cmath>

#include "worker/render/lights/lights.h"
#include "worker/render/media/medium.h"

namespace ls::render {

C3 Lights::spot_radiance(const Light& l, const V3& towards) const {
  const float z = dot(towards, l.normal);
  if (z <= l.cos_cutoff) return {0, 0, 0};
  C3 value = l.value;
  if (z < l.cos_beam) value *= (l.cutoff - std::acos(std::min(z, 1.f))) * l.inv_transition;
  if (l.textured) {
    const float k = .5f / (z * l.tan_cutoff);
    value *=
        textures_->eval(l.radiance, {.5f + dot(towards, l.axis_u) * k, .5f + dot(towards, l.axis_v) * k});
  }
  return value;
}

// The intensity of a projector in the direction `towards`. It gives the plane at distance 1 along its axis
// the irradiance `value` times the image, at any angle: a ray at the cosine c to the axis meets it at
// distance 1 / c and the same cosine, so the intensity is value / c^3.
C3 Lights::projected(const Light& l, const V3& towards) const {
  const float z = dot(towards, l.normal);
  if (!(z > 0)) return {0, 0, 0};
  const float x = dot(towards, l.axis_u) / (z * l.tan_x), y = dot(towards, l.axis_v) / (z * l.tan_y);
  if (!(std::abs(x) <= 1) || !(std::abs(y) <= 1)) return {0, 0, 0};
  // As for cameras, x points to the left and y up, and uv is measured from the upper left corner of the
  // image.
  return l.value * textures_->eval(l.radiance, {.5f - .5f * x, .5f - .5f * y}) / (z * z * z);
}

C3 Lights::varying_radiance(const Light& l, V2 uv, const FacePoint* face, float cosine) const {
  const C3 value = textures_->eval(l.radiance, uv, face);
  return l.beam ? value * beam_share(l, cosine) : value;
}

float Lights::beam_share(const Light& l, float cosine) {
  if (cosine >= l.cos_beam) return 1;
  if (!(cosine > l.cos_cutoff)) return 0;
  return std::pow((cosine - l.cos_cutoff) * l.inv_transition, l.falloff);
}

// Samples a direction uniformly over the sun's solid angle. It uses 1 - cos to avoid cancellation.
LightSample Lights::sample_sun(const Light& l, V2 u) {
  const float one_minus = l.cone * u.x, sine = std::sqrt(one_minus * (2 - one_minus));
  const V2 circle = unit_circle(u.y) * sine;
  LightSample s;
  s.direction = normalize(Frame(-l.normal).to_world({circle.x, circle.y, 1 - one_minus}));
  s.distance = kInfinity;
  s.radiance = l.value;
  s.pdf = l.sun_density * l.probability;
  return s;
}

// The radiance of the suns that a direction d hits. Whether it hits a sun with the axis a is decided by the
// chord, |d - a|^2 = 2 (1 - cos), which keeps the digits that the cosine of a small angle loses.
C3 Lights::suns(const V3& direction, float pdf) const {
  C3 sum(0);
  for (const std::uint32_t i : suns_) {
    const Light& l = lights_[i];
    const V3 chord = direction + l.normal;
    if (dot(chord, chord) <= 2 * l.cone) sum += l.value * (1 / (1 + l.sun_density * l.probability / pdf));
  }
  return sum;
}

}  // namespace ls::render
