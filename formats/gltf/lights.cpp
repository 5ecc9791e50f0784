// Translates lights that have no surface: the directional, point and spot lights of KHR_lights_punctual.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/gltf/translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

// Adds the two angles of a spot light to `out`. Both are measured from the axis: the intensity is full within
// innerConeAngle and 0 beyond outerConeAngle. Equal angles are a cone with a hard edge, which several
// programs write though the specification wants the inner one to be smaller.
void add_cone(Translation& t, const Item& spot, Element& out) {
  constexpr double kRight = std::numbers::pi / 2;
  double outer = spot["outerConeAngle"].number(std::numbers::pi / 4),
         inner = spot["innerConeAngle"].number(0);
  if (!(outer > 0 && outer <= kRight * (1 + kSingle) && inner >= -kSingle && inner <= outer * (1 + kSingle)))
    return spot.error("a cone is wanted with 0 <= innerConeAngle <= outerConeAngle <= pi/2");
  outer = std::min(outer, kRight);
  inner = std::clamp(inner, 0., outer);
  add(out, "cutoff_angle", outer * kDegrees, out.at);
  add(out, "beam_width", inner * kDegrees, out.at);
  if (inner == outer) return;
  t.warn_once(spot,
              "between its two angles a spot falls off linearly in the angle here, and in glTF by the square "
              "of its cosine's share");
}

}  // namespace

// Translates a light. In glTF the value of a directional light is an illuminance in lux, that of other lights
// an intensity in candela. The numbers are used unchanged as irradiance and as radiant intensity.
void add_light(Translation& t, const Standing& light) {
  const Item index = light.node.extension("KHR_lights_punctual")["light"];
  if (!index.given()) return light.node.error("KHR_lights_punctual needs the index of a light");
  const Item given = index.in(t.root.extension("KHR_lights_punctual")["lights"]);
  if (!given.given()) return;
  auto colour = given["color"].numbers<3>({1, 1, 1});
  const double intensity = given["intensity"].number(1);
  for (double& x : colour) x *= intensity;
  if (colour == std::array<double, 3>{0, 0, 0}) return;
  const std::string type = given["type"].text("");
  const Span at = given.at();
  const auto facing_world = facing(light.to_world);
  if (!facing_world && type != "point")
    return light.node.error("the transform of this light leaves it no direction");
  Element out;
  if (type == "directional") {
    out = made("emitter", "directional", at);
    scene::add(out, "vector", "direction",
               Vec3{{facing_world->m[2], facing_world->m[6], facing_world->m[10]}}, at);
    scene::add(out, "irradiance", Rgb{colour}, at);
  } else if (type == "point") {
    out = made("emitter", "point", at);
    scene::add(out, "point", "position", origin_of(light.to_world), at);
    scene::add(out, "intensity", Rgb{colour}, at);
  } else if (type == "spot") {
    out = made("emitter", "spot", at);
    place(out, *facing_world, at);
    scene::add(out, "intensity", Rgb{colour}, at);
    add_cone(t, given["spot"], out);
  } else {
    return given["type"].error("a light is \"directional\", \"point\" or \"spot\"");
  }
  t.has_light = true;
  t.add(std::move(out));
}

}  // namespace ls::scene::gltf
