// Translates Nori's emitters.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "formats/nori/object.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::nori {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Element light(std::string_view type, const Object& o) { return made("emitter", type, o.element().at); }

Rgb times(const Rgb& c, double factor) { return {c[0] * factor, c[1] * factor, c[2] * factor}; }

void need(Object& o, std::string_view parameter) {
  if (!o.has(parameter)) o.missing(parameter);
}

Element point(Object& o) {
  need(o, "power");
  Element out = light("point", o);
  add_as(out, o.take("position"), "position");
  add(out, "intensity", times(o.color("power", {0, 0, 0}), 1 / (4 * std::numbers::pi)), o.element().at);
  return out;
}

Element parallel(Object& o) {
  Element out = light("directional", o);
  o.both("direction", "toWorld");
  o.both("irradiance", "radiance");
  if (!o.has("direction") && !o.has("toWorld")) o.missing("direction");
  if (!o.has("irradiance") && !o.has("radiance")) o.missing("irradiance");
  add_as(out, o.take("direction"), "direction");
  if (o.has("toWorld")) add_transform(out, o.take("toWorld"), "to_world");
  add_as(out, o.take(o.has("radiance") ? "radiance" : "irradiance"), "irradiance");
  add_as(out, o.take("angularRadius"), "angular_radius");
  return out;
}

// Makes a light that is a disk at infinity with the given radiance and angular radius thetaA (degrees). At
// 180 degrees it is a constant environment.
Element disk(Object& o, Report& report) {
  need(o, "radiance");
  need(o, "thetaA");
  const Rgb radiance = o.color("radiance", {1, 1, 1});
  const double angle = o.number("thetaA", 0);
  const Element* to_world = o.take("toWorld");
  if (angle == 180) {
    Element out = light("constant", o);
    add(out, "radiance", radiance, o.element().at);
    return out;
  }
  if (angle > 90)
    report.error(
        o.element().at,
        fmt::format(
            "{} has an angle thetaA of {}: it can be 90 at most, or 180, which is light from everywhere",
            o.title(), angle));
  Element out = light("directional", o), mirror = made("scale", "", o.element().at);
  // In Nori +z points to the disk. The direction of a directional emitter is that in which its light travels,
  // away from the disk. So z is mirrored.
  set(mirror, "value", "1 1 -1", o.element().at);
  add_transform(out, to_world, "to_world", {std::move(mirror)});
  const double sine = std::sin(angle * kDegree);
  add(out, "irradiance", times(radiance, std::numbers::pi * sine * sine), o.element().at);
  add(out, "angular_radius", angle, o.element().at);
  return out;
}

Element environment(Object& o) {
  need(o, "filename");
  Element out = light("envmap", o);
  add_as(out, o.take("filename"), "filename");
  add_as(out, o.take("strength"), "scale");
  // Rotates the map, because the directions of its pixels differ. In Mitsuba +y is at the top of the map, -z
  // at its left edge and +x a quarter of the width further; in Nori these are +z, +x and +y.
  add_transform(out, o.take("toWorld"), "to_world",
                {matrix_step({0, 0, -1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1}, o.element().at)});
  return out;
}

Element spot(Object& o, Report& report) {
  need(o, "direction");
  Element out = light("spot", o), lookat = made("lookat", "", o.element().at);
  const Vec3 at = o.triple("position", {{0, 0, 0}}), way = o.triple("direction", {{0, 0, 1}});
  if (way == Vec3{{0, 0, 0}}) report.error(o.element().at, "the direction of this light is zero");
  set(lookat, "origin", fmt::format("{} {} {}", at[0], at[1], at[2]), o.element().at);
  set(lookat, "target", fmt::format("{} {} {}", at[0] + way[0], at[1] + way[1], at[2] + way[2]),
      o.element().at);
  add_transform(out, nullptr, "to_world", {std::move(lookat)});
  add_as(out, o.take("intensity"), "intensity");
  return out;
}

// Adds the two angles of a spot light: full intensity within beam_width, no light beyond cutoff. Both are
// always written, since Mitsuba's defaults differ from Nori's.
void add_cone(Element& out, Object& o, Report& report) {
  const double cutoff = o.number("cutoff", 20), beam = o.number("beam_width", cutoff * 3 / 4);
  if (beam > cutoff)
    report.error(o.element().at, fmt::format("beam_width {} is wider than cutoff {}", beam, cutoff));
  add(out, "cutoff_angle", cutoff, o.element().at);
  add(out, "beam_width", beam, o.element().at);
}

}  // namespace

std::optional<Element> emitter(const Element& e, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  std::optional<Element> out;
  if (plugin->type == "area")
    return report.refuse(e.at, "an emitter \"area\" stands in the mesh that shines");
  if (plugin->type == "point") out = point(o);
  if (plugin->type == "directional" || plugin->type == "distant") out = parallel(o);
  if (plugin->type == "distantdisk") out = disk(o, report);
  if (plugin->type == "envmap") out = environment(o);
  if (plugin->type == "constant") {
    out = light("constant", o);
    add_as(*out, o.take("radiance"), "radiance");
  }
  if (plugin->type == "spot") {
    out = spot(o, report);
    add_cone(*out, o, report);
  }
  o.finish();
  return out;
}

std::optional<Element> mesh_emitter(const Element& e, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  if (plugin->type != "area" && plugin->type != "spot")
    return report.refuse(
        value_place(e, "type"),
        fmt::format("a mesh can hold an emitter \"area\" or \"spot\", not \"{}\"", plugin->type));
  need(o, "radiance");
  Element out = light("area", o);
  add_as(out, o.take("radiance"), "radiance");
  if (plugin->type == "spot") {
    add_cone(out, o, report);
    add_as(out, o.take("falloff"), "falloff");
  }
  o.finish();
  return out;
}

}  // namespace ls::scene::nori
