// The parameters of shapes, camera and film, with ranges, defaults and documentation (describe.h).
#pragma once

#include "core/scene/schema/describe.h"

namespace ls::scene {

LS_TYPE(RectangleShape, "shape", "rectangle", "", "[-1, 1]^2 in the plane z = 0, normal +z")
template <class V, Of<RectangleShape> T>
void describe(V&, T&) {}

LS_TYPE(CubeShape, "shape", "cube", "", "[-1, 1]^3, normals outwards")
template <class V, Of<CubeShape> T>
void describe(V&, T&) {}

LS_TYPE(DiskShape, "shape", "disk", "", "unit disk in the plane z = 0, normal +z")
template <class V, Of<DiskShape> T>
void describe(V&, T&) {}

LS_TYPE(SphereShape, "shape", "sphere", "",
        "a ball's surface; `center` and `radius` act before `to_world`, which may not stretch it")
template <class V, Of<SphereShape> T>
void describe(V& v, T& s) {
  v.field({.name = "center", .doc = "centre", .unit = "length", .given_as = "point"}, s.center);
  v.field(quantity("radius", "radius", "length", kPositive), s.radius);
}

LS_TYPE(MeshShape, "shape", "mesh", "obj, ply, serialized", "triangles from a file")
template <class V, Of<MeshShape> T>
void describe(V& v, T& s) {
  v.field(
      {.name = "filename", .doc = "Wavefront OBJ, Stanford PLY or Mitsuba's `.serialized`", .required = true},
      s.file);
  v.field({.name = "format", .doc = "of the file: the plugin's name", .derived = true}, s.format);
  v.field({.name = "face_normals", .doc = "flat shading: the file's vertex normals are left out"},
          s.face_normals);
  v.field(
      {.name = "flat_without_normals",
       .doc = "flat shading if the file has no vertex normals, as in Nori and pbrt; else it is smooth then",
       .elided = true},
      s.flat_without_normals);
  v.field({.name = "flip_tex_coords", .doc = "v becomes 1 - v; true unless said otherwise for `obj`"},
          s.flip_tex_coords);
  v.field({.name = "shape_index", .doc = "which mesh of a `serialized` file", .range = {0, 1e6}},
          s.shape_index);
}

LS_TYPE(CylinderShape, "shape", "cylinder", "",
        "an open cylinder about the line from `p0` to `p1`, normals outwards; `to_world` may stretch it "
        "along that line only")
template <class V, Of<CylinderShape> T>
void describe(V& v, T& s) {
  v.field({.name = "p0", .doc = "where its axis begins", .unit = "length", .given_as = "point"}, s.p0);
  v.field({.name = "p1", .doc = "where its axis ends", .unit = "length", .given_as = "point"}, s.p1);
  v.field(quantity("radius", "radius", "length", kPositive), s.radius);
}

template <class V, Of<MotionKey> T>
void describe(V& v, T& k) {
  v.field({.name = "time", .doc = "", .derived = true}, k.time);
  v.field({.name = "to_world", .doc = "", .derived = true}, k.to_world);
}

// The field of objects that can move.
inline constexpr Field kMotionField{
    .name = "motion", .doc = "keys of the animation", .derived = true, .elided = true};

LS_TYPE(ShapeGroup, "shape", "shapegroup", "",
        "shapes that are seen where an `instance` of the group stands, and kept in memory once; they stand "
        "inside, placed within the group by their own `to_world`. Shapes that emit light, and instances, "
        "can't be in a group")
template <class V, Of<ShapeGroup> T>
void describe(V&, T&) {}

LS_TYPE(Instance, "shape", "instance", "",
        "a `shapegroup` once more: a `<ref>` to it, or the group itself, stands inside")
template <class V, Of<Instance> T>
void describe(V& v, T& s) {
  v.field(nested_field("group", "the group", "<shapegroup>"), s.group);
  v.field({.name = "to_world",
           .doc = "places the group in the world; or an `<animation>`, by which it moves while the shutter "
                  "is open (docs/guide/motion-blur.md)"},
          s.to_world);
  v.field(kMotionField, s.motion);
}
// Describes the fields that all kinds of shapes have. Geometry, emitter, bsdf and media are nested objects.
template <class V, Of<Shape> T>
void describe(V& v, T& s) {
  v.field({.name = "geometry", .doc = "the plugin", .derived = true}, s.geometry);
  v.field({.name = "to_world",
           .doc = "places the shape in the world; or an `<animation>`, by which it moves while the shutter "
                  "is open (docs/guide/motion-blur.md)"},
          s.to_world);
  v.field(kMotionField, s.motion);
  v.field({.name = "flip_normals", .doc = "turns the normals, and so inside and outside"}, s.flip_normals);
  v.field(nested_field("bsdf", "`diffuse` if there is none, black if the shape emits light", "<bsdf>"),
          s.bsdf);
  v.field(nested_field("emitter", "an `area`: the shape emits light", "<emitter>"), s.emitter);
  v.field(nested_field("interior", "what is on the side that the normal points away from", "medium"),
          s.interior);
  v.field(nested_field("exterior", "what is on the side that the normal points to", "medium"), s.exterior);
  v.field({.name = "is_medium_transition", .doc = "whether one of the two was given", .derived = true},
          s.is_medium_transition);
  v.field({.name = "group", .doc = "the group that it is in", .derived = true}, s.group);
  v.field(
      on_unless_given("visible_camera",
                      "whether the camera sees it; if not, camera rays pass straight through it, while it "
                      "still casts shadows, shines and shows in mirrors. Not in Mitsuba"),
      s.visible_camera);
  v.field(
      {.name = "holdout",
       .doc = "where the camera sees it, it cuts a hole into the image: black, with an alpha of 0 but for "
              "media in front. Not in Mitsuba",
       .elided = true},
      s.holdout);
  v.field({.name = "shadow_catcher",
           .doc = "with a `transparent` film, the camera sees of it only the shadows on it: black, with an "
                  "alpha of the share of direct light that is missing. Not in Mitsuba",
           .elided = true},
          s.shadow_catcher);
  v.field(on_unless_given("visible_shadow",
                          "whether rays to lamps meet it; if not, it casts no shadow in direct light. Not in "
                          "Mitsuba"),
          s.visible_shadow);
  v.field(on_unless_given("visible_reflection",
                          "whether rays meet it that a surface reflected or refracted; if not, it is missing "
                          "in mirrors and behind glass, and its lamp lights no surface. Not in Mitsuba"),
          s.visible_reflection);
  v.field(on_unless_given("visible_volume",
                          "whether rays meet it that a medium scattered; if not, its lamp lights no medium. "
                          "Not in Mitsuba"),
          s.visible_volume);
  v.field(link_sets_field("link sets that the shape is in, for `receivers` and `blockers` of lights: names, "
                          "separated by commas; letters, digits, `_` and `-`. Not in Mitsuba"),
          s.link_sets);
  v.field({.name = "meter", .doc = "what is measured on it", .derived = true, .elided = true}, s.meter);
}

// Camera and film.
LS_TYPE(BoxFilter, "rfilter", "box", "", "each sample counts in its own pixel")
template <class V, Of<BoxFilter> T>
void describe(V& v, T& f) {
  v.field({.name = "radius", .doc = "half width", .unit = "pixels", .range = {0, 32, true}, .unwritten = .5},
          f.radius);
}

LS_TYPE(TentFilter, "rfilter", "tent", "", "falls off linearly")
template <class V, Of<TentFilter> T>
void describe(V& v, T& f) {
  v.field(quantity("radius", "half width", "pixels", {0, 32, true}), f.radius);
}

LS_TYPE(GaussianFilter, "rfilter", "gaussian", "", "Gaussian, cut at four standard deviations")
template <class V, Of<GaussianFilter> T>
void describe(V& v, T& f) {
  v.field(quantity("stddev", "standard deviation", "pixels", {0, 8, true}), f.stddev);
}

LS_TYPE(Sensor, "sensor", "perspective", "perspective, thinlens, orthographic, spherical",
        "looks along the +z of `to_world`, +y up, +x to the left. `orthographic`: parallel rays from a sheet "
        "of 2 by 2 height / width, which `to_world` may scale. `spherical`: all directions by latitude and "
        "longitude, +y in the top row; of the horizon the left edge is -z, a quarter of the width further +x")
template <class V, Of<Sensor> T>
void describe_place(V& v, T& s) {
  v.field({.name = "to_world",
           .doc = "places and turns the camera; or an `<animation>` of transforms with times, by which it "
                  "moves while the shutter is open (docs/guide/motion-blur.md)"},
          s.to_world);
  v.field({.name = "shutter_open",
           .doc = "time at which the exposure begins; 0 unless it is given",
           .range = {-kMaxTime, kMaxTime},
           .unwritten = 0,
           .elided = true},
          s.shutter_open);
  v.field({.name = "shutter_close",
           .doc = "time at which the exposure ends; 0 unless it is given",
           .range = {-kMaxTime, kMaxTime},
           .unwritten = 0,
           .elided = true},
          s.shutter_close);
}
template <class V, Of<Sensor> T>
void describe_clips(V& v, T& s) {
  describe_place(v, s);
  v.field(quantity("near_clip", "nearest depth that is seen (not `spherical`)", "length", kPositive),
          s.near_clip);
  v.field(quantity("far_clip", "farthest depth that is seen, of surfaces and of media (not `spherical`)",
                   "length", kPositive),
          s.far_clip);
}
template <class V, Of<Sensor> T>
void describe_perspective(V& v, T& s) {
  describe_clips(v, s);
  v.field(quantity("fov",
                   "field of view along fov_axis; or `focal_length` (\"50mm\" unless either is given); this "
                   "and all that follows of `perspective` and `thinlens` only",
                   "degrees", kFieldOfView),
          s.fov);
  v.field({.name = "fov_axis", .doc = "what fov measures"}, s.fov_axis);
  v.field({.name = "principal_point_offset_x",
           .doc = "how far right of its place the camera looks",
           .unit = "frame widths",
           .unwritten = 0},
          s.principal_point_offset[0]);
  v.field({.name = "principal_point_offset_y",
           .doc = "how far below its place the camera looks",
           .unit = "frame heights",
           .unwritten = 0},
          s.principal_point_offset[1]);
}
template <class V, Of<Sensor> T>
void describe_lens(V& v, T& s) {
  v.field(quantity("aperture_radius", "radius of the lens (`thinlens` only, and needed there); 0: pinhole",
                   "length", kNonNegative),
          s.aperture_radius);
  v.field(quantity("focus_distance", "depth that is sharp (`thinlens`); far_clip if not given", "length",
                   kPositive),
          s.focus_distance);
  v.field({.name = "aperture_scale",
           .doc = "over the frame, (0, 0) its upper left corner: multiplies aperture_radius (`thinlens`; not "
                  "in Mitsuba)",
           .range = kUnit},
          s.aperture_scale);
}
template <class V, Of<Sensor> T>
void describe(V& v, T& s) {
  v.field({.name = "projection", .doc = "the plugin", .derived = true}, s.projection);
  describe_perspective(v, s);
  describe_lens(v, s);
  v.field(nested_field("medium", "what the camera is in; the name may be left out", "medium"), s.medium);
  v.field(kMotionField, s.motion);
}

LS_TYPE(
    Meter, "sensor", "irradiancemeter", "irradiancemeter, fluxmeter, radiancemeter, fluencemeter",
    "measures numbers instead of an image (docs/guide/meters.md). `irradiancemeter`: in a shape, the mean "
    "irradiance of the shape's surface, on the side of its normal; or at points. `fluxmeter`, only in a "
    "shape: the same times the area of the shape. `radiancemeter`: the radiance that arrives at points "
    "along directions. `fluencemeter`: the integral of the radiance over all directions, at points. Also "
    "a `batch` of such sensors. `fluxmeter`, `points` and `filename` are not in Mitsuba")
template <class V, Of<MeterPoint> T>
void describe(V& v, T& p) {
  v.field({.name = "position", .doc = "", .derived = true}, p.position);
  v.field({.name = "direction", .doc = "", .derived = true}, p.direction);
}
template <class V, Of<Meter> T>
void describe(V& v, T& m) {
  v.field({.name = "name", .doc = "the sensor's id", .derived = true}, m.name);
  v.field({.name = "kind", .doc = "the plugin", .derived = true}, m.kind);
  v.field({.name = "points",
           .doc = "positions, each with its normal (`irradiancemeter`) or direction (`radiancemeter`): rows "
                  "of `x y z nx ny nz`, of a `fluencemeter` `x y z`, separated by `;`; or, in a text or CSV "
                  "file that `filename` names, by ends of lines. A single one may be given by `origin` and "
                  "`direction`, or by `to_world`, which looks along +z",
           .derived = true,
           .given_as = "string"},
          m.points);
  v.field(nested_field("medium", "what is around everything; media that shapes hold are found by themselves",
                       "medium"),
          m.medium);
}

LS_TYPE(FilmSettings, "film", "hdrfilm", "", "size of the frame and its reconstruction filter")
template <class V, Of<FilmSettings> T>
void describe(V& v, T& f) {
  v.field(quantity("width", "of the frame", "pixels", {1, kMaxFrameSide}), f.size.width);
  v.field(quantity("height", "of the frame", "pixels", {1, kMaxFrameSide}), f.size.height);
  v.field(nested_field("filter", "reconstruction filter; `gaussian` if there is none", "<rfilter>"),
          f.filter);
  v.field(
      quantity("crop_offset_x", "of the part of the frame that is rendered", "pixels", {0, kMaxFrameSide}),
      f.crop_offset[0]);
  v.field(
      quantity("crop_offset_y", "of the part of the frame that is rendered", "pixels", {0, kMaxFrameSide}),
      f.crop_offset[1]);
  v.field(quantity("crop_width",
                   "of the part that is rendered, which is the image that is written; the whole frame if it "
                   "is not given. A size that a job asks for is that of this part",
                   "pixels", {0, kMaxFrameSide}),
          f.crop_size.width);
  v.field(quantity("crop_height", "likewise", "pixels", {0, kMaxFrameSide}), f.crop_size.height);
  v.field(
      {.name = "transparent",
       .doc = "the camera does not see the environment, which still lights the scene, and the image has a "
              "channel A, by which R, G and B are already multiplied (docs/guide/compositing.md). Not in "
              "Mitsuba",
       .elided = true},
      f.transparent);
}

}  // namespace ls::scene
