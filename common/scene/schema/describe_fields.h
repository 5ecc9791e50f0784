// The describe() overloads of the table; see describe.h.
#pragma once

#include "common/scene/schema/describe.h"
#include "common/scene/schema/describe_shapes.h"
#include "common/scene/schema/describe_surfaces.h"

namespace ls::scene {

// Textures.
template <class V, Of<ConstantTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "value", .doc = "the colour"}, t.value);
}
template <class V, Of<BitmapTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "filename", .doc = "the image", .required = true}, t.file);
  v.field({.name = "filter_type", .doc = "between texels"}, t.filter);
  v.field({.name = "wrap_mode", .doc = "outside [0, 1]"}, t.wrap);
  v.field({.name = "raw", .doc = "values are not colours: no sRGB decoding of 8- and 16-bit files"}, t.raw);
  v.field({.name = "to_uv",
           .doc = "moves (u, v) before the look-up: of a 4 x 4 matrix its x and y rows and its translation"},
          t.to_uv);
  v.field({.name = "alpha", .doc = "it is an opacity", .derived = true}, t.alpha);
  v.field(
      {.name = "channel",
       .doc = "one channel as a number, without sRGB decoding; 1 where the image lacks it. Not in Mitsuba",
       .elided = true},
      t.channel);
}
template <class V, Of<CheckerboardTexture> T>
void describe(V& v, T& t) {
  v.field(
      {.name = "color0", .doc = "first colour or texture", .range = kNonNegative, .fallback = {.4, .4, .4}},
      t.color0);
  v.field(
      {.name = "color1", .doc = "second colour or texture", .range = kNonNegative, .fallback = {.2, .2, .2}},
      t.color1);
  v.field({.name = "to_uv", .doc = "moves (u, v) before the look-up"}, t.to_uv);
}

template <class V, Of<PeakTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "texture", .doc = "the texture", .range = kNonNegative}, t.texture);
  v.field({.name = "hue", .doc = "the colour divided by its largest channel, white where it is black"},
          t.hue);
}

template <class V, Of<ProductTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "first", .doc = "a colour or texture", .range = kNonNegative}, t.first);
  v.field({.name = "second", .doc = "a colour or texture", .range = kNonNegative}, t.second);
  v.field({.name = "threshold",
           .doc = "above 0: the value is 1 where the product's luminance is at least this, else 0",
           .range = kNonNegative,
           .unwritten = 0,
           .elided = true},
          t.threshold);
}

template <class V, Of<MeshAttributeTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "name", .doc = "of the attribute, with `vertex_` or `face_` in front", .required = true},
          t.name);
  v.field({.name = "scale", .doc = "multiplies it", .range = kNonNegative}, t.scale);
}

// Volumes and media.
template <class V, Of<ConstVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "value", .doc = "the value", .range = kNonNegative}, s.value);
  v.field({.name = "to_world", .doc = "moves the cube [0, 1]^3 that it fills as a density"}, s.to_world);
}
template <class V, Of<GridVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "filename",
           .doc = "Mitsuba `.vol`, OpenVDB `.vdb`, NanoVDB `.nvdb` or raw `.bin`",
           .required = true},
          s.file);
  v.field(
      {.name = "grid_name", .doc = "which grid of a `.vdb` or `.nvdb`; empty: the only one, or \"density\""},
      s.grid_name);
  v.field({.name = "filter_type", .doc = "between voxels"}, s.filter);
  v.field(
      {.name = "wrap_mode",
       .doc = "what a `.vol` goes on with beyond its outermost voxels' centres, and as an albedo beyond its "
              "box; a density ends there"},
      s.wrap);
  v.field(
      {.name = "use_grid_bbox", .doc = "place the grid by the bounding box in its file instead of [0, 1]^3"},
      s.use_grid_bbox);
  v.field(
      {.name = "node_centred",
       .doc = "the outermost values sit on the faces of the box instead of half a voxel inside it; true in "
              "files of version 0.x; not for `.vdb`"},
      s.node_centred);
  v.field({.name = "raw", .doc = "no colour conversion; without effect, as volumes are linear RGB here"},
          s.raw);
  v.field({.name = "to_world", .doc = "places the grid's box in the world"}, s.to_world);
  v.field({.name = "order", .doc = "which index of a `.bin` file's values runs fastest"}, s.order);
}
template <class V, Of<IsotropicPhase> T>
void describe(V&, T&) {}
template <class V, Of<HgPhase> T>
void describe(V& v, T& p) {
  v.field({.name = "g", .doc = "mean cosine; positive: forwards", .range = {-1, 1, true, true}}, p.g);
}
template <class V>
void describe_priority(V& v, auto& priority) {
  v.field(
      {.name = "priority",
       .doc = "where media overlap, those of the highest priority are there and the others are not; equal "
              "ones add up. Not in Mitsuba",
       .range = {-1000000, 1000000},
       .unwritten = 0,
       .elided = true},
      priority);
}
template <class V, Of<HomogeneousMedium> T>
void describe(V& v, T& m) {
  v.field({.name = "sigma_t",
           .doc = "extinction",
           .unit = "1/length",
           .range = kNonNegative,
           .constvolume = true},
          m.sigma_t);
  v.field({.name = "albedo",
           .doc = "share of extinction that is scattering",
           .range = kUnit,
           .constvolume = true},
          m.albedo);
  v.field({.name = "scale", .doc = "factor on sigma_t", .range = kNonNegative}, m.scale);
  v.field({.name = "phase",
           .doc = "how light is scattered; `isotropic` if there is none",
           .derived = true,
           .given_as = "<phase>"},
          m.phase);
  v.field({.name = "emission",
           .doc = "light given off, whatever the extinction",
           .unit = "radiance/length",
           .range = kNonNegative,
           .constvolume = true,
           .unwritten = 0},
          m.emission);
  v.field({.name = "source_radiance",
           .doc = "light given off per absorption: sigma_a times this",
           .unit = "radiance",
           .range = kNonNegative,
           .constvolume = true,
           .unwritten = 0},
          m.source_radiance);
  describe_priority(v, m.priority);
}
template <class V, Of<HeterogeneousMedium> T>
void describe(V& v, T& m) {
  v.field({.name = "sigma_t", .doc = "extinction", .unit = "1/length", .range = kNonNegative}, m.sigma_t);
  v.field({.name = "albedo",
           .doc = "share of extinction that is scattering",
           .range = kUnit,
           .fallback = {.75, .75, .75}},
          m.albedo);
  v.field({.name = "scale", .doc = "factor on sigma_t", .range = kNonNegative}, m.scale);
  v.field({.name = "phase",
           .doc = "how light is scattered; `isotropic` if there is none",
           .derived = true,
           .given_as = "<phase>"},
          m.phase);
  v.field({.name = "emission",
           .doc = "light given off, whatever the extinction; a grid ends at its box, one value is everywhere "
                  "in the medium",
           .unit = "radiance/length",
           .range = kNonNegative},
          m.emission);
  v.field({.name = "source_radiance",
           .doc = "light given off per absorption: sigma_a times this",
           .unit = "radiance",
           .range = kNonNegative},
          m.source_radiance);
  v.field({.name = "temperature",
           .doc = "the medium glows as a black body: sigma_a times its radiance at temperature_offset + "
                  "temperature_scale * this",
           .unit = "K",
           .range = kNonNegative},
          m.temperature);
  v.field({.name = "emission_scale",
           .doc = "factor on the light given off",
           .range = kNonNegative,
           .unwritten = 1},
          m.emission_scale);
  v.field({.name = "temperature_scale",
           .doc = "kelvin per unit of `temperature`",
           .range = kNonNegative,
           .unwritten = 1},
          m.temperature_scale);
  v.field(
      {.name = "temperature_offset", .doc = "added to it", .unit = "K", .range = {-1e6, 1e6}, .unwritten = 0},
      m.temperature_offset);
  describe_priority(v, m.priority);
}

// Emitters.
template <class V, Of<AreaEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "radiance", .doc = "emitted radiance", .range = kNonNegative}, e.radiance);
  v.field({.name = "cutoff_angle",
           .doc = "dark beyond this angle from the normal",
           .unit = "degrees",
           .range = {0, 90, true},
           .unwritten = 90},
          e.cutoff_angle);
  v.field({.name = "beam_width",
           .doc = "all of the radiance within this angle from the normal; 3/4 of a given cutoff_angle if not "
                  "given",
           .unit = "degrees",
           .range = {0, 90},
           .unwritten = 90},
          e.beam_width);
  v.field({.name = "falloff", .doc = "exponent between the two", .range = {0, 1000}, .unwritten = 1},
          e.falloff);
}
template <class V, Of<ConstantEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "radiance", .doc = "radiance", .range = kNonNegative}, e.radiance);
}
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
}
template <class V, Of<PointEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "position", .doc = "where, in the world", .unit = "length", .given_as = "point"},
          e.position);
  v.field({.name = "intensity", .doc = "radiant intensity", .unit = "W/sr", .range = kNonNegative},
          e.intensity);
}
template <class V, Of<SpotEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "to_world", .doc = "places and turns the light"}, e.to_world);
  v.field({.name = "intensity",
           .doc = "radiant intensity within the beam",
           .unit = "W/sr",
           .range = kNonNegative},
          e.intensity);
  v.field({.name = "cutoff_angle",
           .doc = "dark beyond this angle from the axis",
           .unit = "degrees",
           .range = {0, 180, true, true}},
          e.cutoff_angle);
  v.field({.name = "beam_width",
           .doc = "full intensity within this angle; 3/4 of cutoff_angle if not given",
           .unit = "degrees",
           .range = {0, 180}},
          e.beam_width);
  v.field({.name = "texture", .doc = "an image projected by the light", .range = kNonNegative}, e.texture);
}

template <class V, Of<EnvmapEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "filename", .doc = "the image", .required = true}, e.file);
  v.field({.name = "scale", .doc = "multiplies the image's values", .range = kNonNegative}, e.scale);
  v.field({.name = "to_world", .doc = "turns or mirrors the map; moving it changes nothing"}, e.to_world);
}

template <class V, Of<ProjectorEmitter> T>
void describe(V& v, T& e) {
  v.field({.name = "irradiance", .doc = "the image", .range = kNonNegative}, e.irradiance);
  v.field({.name = "scale", .doc = "multiplies the image", .range = kNonNegative}, e.scale);
  v.field({.name = "to_world", .doc = "places and turns the light"}, e.to_world);
  v.field({.name = "fov",
           .doc = "field of view along fov_axis; or `focal_length` (\"50mm\" unless either is given)",
           .unit = "degrees",
           .range = {0, 180, true, true}},
          e.fov);
  v.field({.name = "fov_axis", .doc = "what fov measures"}, e.fov_axis);
}

// Integrator.
template <class V, Of<IntegratorSettings> T>
void describe(V& v, T& i) {
  v.field({.name = "name",
           .doc = "\"volpath\", \"volpath_distant_mis\", or \"path\" and \"whitted\", which leave media out",
           .derived = true},
          i.name);
  v.field({.name = "max_depth",
           .doc = "longest path in segments: 1 emission, 2 direct light; -1: no limit",
           .range = {-1, kMaxDepthSetting}},
          i.max_depth);
  v.field({.name = "rr_depth",
           .doc = "depth from which Russian roulette may end a path",
           .range = {1, kMaxDepthSetting}},
          i.rr_depth);
  v.field({.name = "hide_emitters", .doc = "lights are invisible to the camera"}, i.hide_emitters);
  v.field({.name = "distance",
           .doc = "`volpath_distant_mis` alone: where on a ray's way through a medium it looks for light: as "
                  "light fades (`exponential`), near the light (`equiangular`), or both (`mis`)"},
          i.distance);
  v.field({.name = "heuristic", .doc = "`volpath_distant_mis` alone: weighs the two against each other"},
          i.heuristic);
  v.field(
      {.name = "camera_points",
       .doc =
           "`volpath` alone: points of a camera ray's way through a medium at which it looks for light; 0: "
           "as many as pay for the scene, perhaps none; -1: none, only where the ray is scattered",
       .range = {-1, kMaxCameraPoints},
       .elided = true},
      i.camera_points);
  v.field(
      {.name = "phase_only",
       .doc = "`volpath` alone: in media with point, spot or projector lights too, directions are those of "
              "the phase function and the material, none is aimed at such a light",
       .elided = true},
      i.phase_only);
  v.field(
      {.name = "light_vertices",
       .doc =
           "`volpath` alone: whether paths are connected to points that a directional emitter lights; 0: if "
           "that pays for the scene; -1: never; 1: always, as far as it is possible",
       .range = {-1, 1},
       .elided = true},
      i.light_vertices);
  v.field(
      {.name = "equiangular",
       .doc = "`volpath` alone: whether light near lamps is looked for along whole ways through a medium; 0: "
              "if that pays for the scene; -1: only where a ray is scattered, and nothing is aimed at lamps",
       .range = {-1, 0},
       .elided = true},
      i.equiangular);
  v.field({.name = "lamp_flights",
           .doc = "`volpath` alone: whether a tenth of all flights through homogeneous media end near point, "
                  "spot and projector lights; 0: if directions are aimed at these; -1: never",
           .range = {-1, 0},
           .elided = true},
          i.lamp_flights);
  v.field(
      {.name = "light_tree",
       .doc = "how one of 32 lights and more is chosen; 0: by distance, direction and power; -1: by power "
              "alone",
       .range = {-1, 0},
       .elided = true},
      i.light_tree);
  v.field(
      {.name = "path_reuse",
       .doc = "`volpath` alone: how many pixels share what their paths find from the second scattering on, "
              "where lights have a place and media are homogeneous; 0: none",
       .range = {0, 64},
       .elided = true},
      i.path_reuse);
}

template <class V, Of<Asset> T>
void describe(V& v, T& a) {
  v.field({.name = "name", .doc = "as the scene calls the file", .derived = true}, a.name);
  v.field({.name = "sha256", .doc = "digest of its bytes", .derived = true}, a.digest);
  v.field({.name = "bytes", .doc = "its size", .derived = true}, a.bytes);
}
template <class V, Of<Label> T>
void describe(V& v, T& l) {
  v.field({.name = "name", .doc = "of the shape or instance", .derived = true}, l.name);
  v.field({.name = "material", .doc = "of the shape's material", .derived = true}, l.material);
}
template <class V, Of<Scene> T>
void describe(V& v, T& s) {
  v.field({.name = "assets", .doc = ""}, s.assets);
  v.field({.name = "textures", .doc = ""}, s.textures);
  v.field({.name = "bsdfs", .doc = ""}, s.bsdfs);
  v.field({.name = "volumes", .doc = ""}, s.volumes);
  v.field({.name = "phases", .doc = ""}, s.phases);
  v.field({.name = "media", .doc = ""}, s.media);
  v.field({.name = "shapes", .doc = ""}, s.shapes);
  v.field({.name = "emitters", .doc = ""}, s.emitters);
  v.field({.name = "sensor", .doc = ""}, s.sensor);
  v.field({.name = "film", .doc = ""}, s.film);
  v.field({.name = "integrator", .doc = ""}, s.integrator);
  v.field({.name = "sample_count", .doc = "samples per pixel, of the sampler", .range = {1, kMaxSpp}},
          s.sample_count);
  v.field({.name = "groups", .doc = ""}, s.groups);
  v.field({.name = "instances", .doc = ""}, s.instances);
  v.field({.name = "aovs", .doc = "", .elided = true}, s.aovs);
  v.field({.name = "shape_labels", .doc = "", .elided = true}, s.shape_labels);
  v.field({.name = "instance_labels", .doc = "", .elided = true}, s.instance_labels);
}

// Accepts any type that the table describes as an object.
struct AnyVisitor {
  template <class T>
  void field(const Field&, T&) {}
};
template <class T>
concept Described = requires(AnyVisitor& v, T& t) {
  describe(v, t);
};

}  // namespace ls::scene
