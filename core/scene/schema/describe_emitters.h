// The parameters of emitters, with ranges, defaults and documentation (describe.h).
#pragma once

#include "core/scene/schema/describe.h"

namespace ls::scene {

LS_TYPE(
    AreaEmitter, "emitter", "area", "",
    "light from the front of the shape that it stands in. `two_sided`, `cutoff_angle`, `beam_width` and "
    "`falloff` are our own. The angles make each point of it a spot light, whose radiance between the two "
    "angles is multiplied by s^falloff, s = (cos a - cos cutoff_angle) / (cos beam_width - cos cutoff_angle)")
template <class V, Of<AreaEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "radiance", .doc = "emitted radiance", .range = kNonNegative}, e.radiance);
  v.field({.name = "cutoff_angle",
           .doc = "dark beyond this angle from the normal",
           .unit = "degrees",
           .range = {0, 90, true},
           .unwritten = 90},
          e.cutoff_angle);
  v.field(
      {.name = "beam_width",
       .doc =
           "all of the radiance within this angle from the normal; 3/4 of a given cutoff_angle if not given",
       .unit = "degrees",
       .range = {0, 90},
       .unwritten = 90},
      e.beam_width);
  v.field({.name = "falloff", .doc = "exponent between the two", .range = {0, 1000}, .unwritten = 1},
          e.falloff);
  v.field({.name = "two_sided", .doc = "the back shines like the front", .elided = true}, e.two_sided);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(ConstantEmitter, "emitter", "constant", "", "the same radiance from everywhere around")
template <class V, Of<ConstantEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "radiance", .doc = "radiance", .range = kNonNegative}, e.radiance);
  v.field(on_unless_given("visible_camera", "whether the camera sees the light itself. Not in Mitsuba"),
          e.visible_camera);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(DirectionalEmitter, "emitter", "directional", "",
        "parallel light from far away; a `to_world` instead of `direction` turns +z. `angular_radius` is our "
        "own: with it the light is a disk in the sky, seen by paths that leave the scene, whose radiance is "
        "irradiance / (pi sin^2 angular_radius)")
template <class V, Of<DirectionalEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "direction", .doc = "the way the light travels, in the world", .given_as = "vector"},
          e.direction);
  v.field({.name = "irradiance", .doc = "on a plane that faces the light", .range = kNonNegative},
          e.irradiance);
  v.field({.name = "angular_radius",
           .doc = "of the disk that the light comes from (the sun's is 0.267); below 0.001 it is a point",
           .unit = "degrees",
           .range = {0, 90},
           .unwritten = 0},
          e.angular_radius);
  v.field(on_unless_given("visible_camera", "whether the camera sees the light itself. Not in Mitsuba"),
          e.visible_camera);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(PointEmitter, "emitter", "point", "",
        "light from a point; a `to_world` instead of `position` moves the origin")
template <class V, Of<PointEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "position", .doc = "where, in the world", .unit = "length", .given_as = "point"},
          e.position);
  v.field(quantity("intensity", "radiant intensity", "W/sr", kNonNegative), e.intensity);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(SpotEmitter, "emitter", "spot", "",
        "light from a point into a cone around the +z of `to_world`, falling off linearly in the angle")
template <class V, Of<SpotEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "to_world", .doc = "places and turns the light"}, e.to_world);
  v.field(quantity("intensity", "radiant intensity within the beam", "W/sr", kNonNegative), e.intensity);
  v.field(quantity("cutoff_angle", "dark beyond this angle from the axis", "degrees", {0, 180, true, true}),
          e.cutoff_angle);
  v.field(quantity("beam_width", "full intensity within this angle; 3/4 of cutoff_angle if not given",
                   "degrees", {0, 180}),
          e.beam_width);
  v.field({.name = "texture", .doc = "an image projected by the light", .range = kNonNegative}, e.texture);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(EnvmapEmitter, "emitter", "envmap", "",
        "light from everywhere around by an image in latitude-longitude form (EXR, HDR or PFM; others, too). "
        "Before `to_world` its top row is +y and its bottom row -y; of the horizon the left edge is -z, a "
        "quarter of the width further +x, the middle +z, three quarters -x, as in Mitsuba 3. It takes 2 x 3 "
        "to 2^25 pixels (8192 x 4096); negative values become 0")
template <class V, Of<EnvmapEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "filename", .doc = "the image", .required = true}, e.file);
  v.field({.name = "scale", .doc = "multiplies the image's values", .range = kNonNegative}, e.scale);
  v.field({.name = "to_world", .doc = "turns or mirrors the map; moving it changes nothing"}, e.to_world);
  v.field({.name = "mapping",
           .doc = "`equal_area` is the square map of pbrt-v4, each of whose texels is one radiance from 4 pi "
                  "/ texels steradians: before `to_world` its centre is +z, its corners -z, the middle of "
                  "its right edge +x, of its lower edge +y. Not in Mitsuba",
           .elided = true},
          e.mapping);
  v.field(on_unless_given("visible_camera", "whether the camera sees the light itself. Not in Mitsuba"),
          e.visible_camera);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
  v.field(image_colours_field(), e.colours);
}

LS_TYPE(ProjectorEmitter, "emitter", "projector", "",
        "throws an image from the origin along the +z of `to_world`, +y up: a `perspective` camera turned "
        "round, with the image's shape for a film. A plane one unit ahead receives pi times scale times the "
        "image, as in Mitsuba 3")
template <class V, Of<ProjectorEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "irradiance", .doc = "the image", .range = kNonNegative}, e.irradiance);
  v.field({.name = "scale", .doc = "multiplies the image", .range = kNonNegative}, e.scale);
  v.field({.name = "to_world", .doc = "places and turns the light"}, e.to_world);
  v.field(quantity("fov", "field of view along fov_axis; or `focal_length` (\"50mm\" unless either is given)",
                   "degrees", {0, 180, true, true}),
          e.fov);
  v.field({.name = "fov_axis", .doc = "what fov measures"}, e.fov_axis);
  v.field({.name = "as_intensity",
           .doc = "scale times the image is a radiant intensity in W/sr, as in pbrt, instead of that "
                  "irradiance. Not in Mitsuba",
           .elided = true},
          e.as_intensity);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

LS_TYPE(
    GoniometricEmitter, "emitter", "goniometric", "",
    "light from a point, the origin of `to_world`, with an intensity by direction as of a measured lamp: "
    "`texture` is a square image of all directions in the equal-area octahedral form of Clarberg (2008) "
    "and pbrt-v4. Before `to_world` its middle is +z and its corners are -z; right is +x and down +y. "
    "Its `wrap_mode` is best `clamp`: others blend what lies on different sides of the square's edge. "
    "`filename` may name the image instead, or an IES file (LM-63) of a real lamp, in which +z is straight "
    "down for a lamp under a ceiling and horizontal angles run from +x towards -y (types A and B: +z is "
    "where the lamp aims, and the angles turn from it towards +x and +y); its candelas are multiplied by "
    "`intensity`. An IES file becomes an image of 512 x 512 directions, each about a third of a degree wide; "
    "one with a narrower beam is refused")
template <class V, Of<GoniometricEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "to_world", .doc = "places, turns and mirrors the light; scaling it has no effect"},
          e.to_world);
  v.field(quantity("intensity", "radiant intensity where the image is 1", "W/sr", kNonNegative), e.intensity);
  v.field({.name = "texture", .doc = "the image, which multiplies the intensity", .range = kNonNegative},
          e.texture);
  describe_receivers(v, e);
  v.field(kLightGroup, e.light_group);
  describe_links(v, e);
}

}  // namespace ls::scene
