// Lights at infinite distance.
#pragma once

#include <variant>

#include "worker/render/lights/envmap.h"
#include "worker/render/lights/light_kind.h"
#include "worker/render/lights/portals.h"

namespace ls::render {

struct DirectionalLight : LightKind {
  V3 travel;  // the direction in which the light travels
  C3 irradiance;

  bool dark(const LightWorld&) const { return is_black(irradiance); }
  double power(const LightWorld& world) const {
    const float radius = world.geometry.radius;
    return luminance(irradiance) * kPiD * radius * radius;
  }
  std::optional<LightSample> sample(const LightWorld&, const LightNumbers&, const V3&, float p) const {
    return LightSample{-travel, kInfinity, V3(0), irradiance, p, true};
  }
};

// The sun: a disk of constant radiance in the sky.
struct SunLight : LightKind {
  V3 travel;
  C3 radiance;
  float cone = 0;     // 1 - cos of the sun's angular radius
  float density = 0;  // 1 / (the sun's solid angle) [1/sr]
  bool seen = true;   // false: camera rays that were not scattered do not see the disk

  bool dark(const LightWorld&) const { return is_black(radiance); }
  double power(const LightWorld& world) const {  // irradiance times area, as for directional lights
    const float radius = world.geometry.radius;
    return luminance(radiance) * kPiD * double{cone} * (2 - double{cone}) * kPiD * radius * radius;
  }
  // Samples a direction uniformly over the sun's solid angle. It computes with 1 - cos of the small angle to
  // the axis, because float32 cannot resolve the cosine itself, which is close to 1.
  std::optional<LightSample> sample(const LightWorld&, const LightNumbers& numbers, const V3&,
                                    float p) const {
    const V2 u = numbers.unit();
    const float one_minus = cone * u.x, sine = std::sqrt(one_minus * (2 - one_minus));
    const V2 circle = unit_circle(u.y) * sine;
    LightSample s;
    s.direction = normalize(Frame(-travel).to_world({circle.x, circle.y, 1 - one_minus}));
    s.distance = kInfinity;
    s.radiance = radiance;
    s.pdf = density * p;
    return s;
  }
  // The radiance that a path finds if it leaves the scene in this direction, weighted against next-event
  // estimation as in Lights::environment(). `pdf` is the density with which the path sampled the direction,
  // and p the probability of choosing this light. The test whether a direction d hits a sun with the axis a
  // uses the chord, |d - a|^2 = 2 (1 - cos), which keeps the digits that the cosine of a small angle loses.
  C3 found(const V3& direction, float pdf, float p) const {
    const V3 chord = direction + travel;
    return dot(chord, chord) <= 2 * cone ? radiance * (1 / (1 + density * p / pdf)) : C3(0);
  }
};

// The sky as a light for next-event estimation. An environment map is sampled by its brightness. If there are
// portals (openings through which the sky lights the scene: portals.h) in front of the shaded point,
// directions through them are sampled too. A constant environment is a part of this light only if there are
// portals; else paths find it when they leave the scene.
struct SkyLight : LightKind {
  // If portals are in front of the shaded point: the probability with which a direction is sampled by the
  // map's brightness alone, so that every direction from which light comes has a positive density. Of the
  // 2^32 random words, kBrightnessWords choose this way of sampling.
  static constexpr float kByBrightness = .25f;
  static constexpr std::uint64_t kBrightnessWords = std::uint64_t{1} << 30;

  const EnvironmentMap* map = nullptr;
  const Portals* portals = nullptr;
  C3 constant{0, 0, 0};

  bool sampled() const { return map || portals; }
  bool dark(const LightWorld&) const { return !portals && map->black(); }
  double power(const LightWorld& world) const {
    const float radius = world.geometry.radius;
    return ((map ? map->flux() : 0) + 4 * kPiD * luminance(constant)) * kPiD * radius * radius;
  }
  // Radiance and density are computed from the sampled direction, not from the random numbers. For paths that
  // leave the scene they are computed in the same way, so the MIS weights of both match.
  std::optional<LightSample> sample(const LightWorld&, const LightNumbers& numbers, const V3& x,
                                    float p) const {
    const auto direction = direction_at(x, numbers);
    if (!direction) return std::nullopt;
    const EnvironmentMap::Light light = from(x, *direction);
    const float pdf = light.pdf * p;
    if (!(pdf > 0) || !std::isfinite(pdf)) return std::nullopt;
    if (portals && is_black(light.radiance)) return std::nullopt;
    return LightSample{*direction, kInfinity, V3(0), light.radiance, pdf, false};
  }
  C3 radiance(const V3& d) const { return map ? map->at(d).radiance + constant : constant; }
  // Returns the radiance that arrives at x from the direction d, and the density, per steradian, with which
  // sample() samples d there if it was called with p = 1.
  EnvironmentMap::Light from(const V3& x, const V3& d) const {
    EnvironmentMap::Light light = map ? map->at(d) : EnvironmentMap::Light{C3(0), 0};
    if (!portals) return light;
    light.radiance += constant;
    if (portals->any_in_front_of(x)) {
      const float share = map ? kByBrightness : 0.f;
      light.pdf = share * light.pdf + (1 - share) * portals->pdf(x, d);
    }
    return light;
  }

 private:
  std::optional<V3> direction_at(const V3& x, const LightNumbers& numbers) const {
    if (map && !(portals && portals->any_in_front_of(x))) return map->sample(numbers.x, numbers.y);
    if (!map) return portals->sample(x, numbers.x, numbers.y);
    // numbers.x decides whether the map alone or the portals are sampled. Its position among the words with
    // the same outcome is used again as a random word.
    if (numbers.x < kBrightnessWords)
      return map->sample(static_cast<std::uint32_t>((std::uint64_t{numbers.x} << 32) / kBrightnessWords),
                         numbers.y);
    const std::uint64_t others = (std::uint64_t{1} << 32) - kBrightnessWords;
    const std::uint64_t rest = ((numbers.x - kBrightnessWords) << 32) / others;
    return portals->sample(x, static_cast<std::uint32_t>(rest), numbers.y);
  }
};

using DistantKinds = Kinds<DirectionalLight, SunLight, SkyLight>;

// The irradiance that a disk of uniform radiance L and angular radius a gives a plane facing its centre is
// the integral of L cos over the disk: 2 pi L integral_0^a cos t sin t dt = pi L sin^2 a.
inline std::variant<DirectionalLight, SunLight> make_light(const DirectionalEmitter& e, const LightWorld&) {
  // The smallest sun [degrees]. Directions in float32 are accurate to 4e-6 degrees. A smaller disk becomes a
  // light of a single direction.
  constexpr double kSmallestSun = 1e-3;
  const V3 travel(V3d(e.direction[0], e.direction[1], e.direction[2]).normalized());
  if (!(e.angular_radius >= kSmallestSun)) return DirectionalLight{{}, travel, color(e.irradiance)};
  const double a = e.angular_radius * (kPiD / 180), half = std::sin(a / 2), sine = std::sin(a);
  SunLight l;
  l.travel = travel;
  l.seen = e.visible_camera;
  l.radiance = color(e.irradiance) * static_cast<float>(1 / (kPiD * sine * sine));
  l.cone = static_cast<float>(2 * half * half);
  l.density = static_cast<float>(1 / (4 * kPiD * half * half));
  return l;
}

}  // namespace ls::render
