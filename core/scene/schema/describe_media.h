// The parameters of volumes, phase functions and media, with ranges, defaults and documentation (describe.h).
#pragma once

#include "core/scene/schema/describe.h"

namespace ls::scene {

LS_TYPE(
    ConstVolume, "volume", "constvolume", "",
    "one value: as the density of a `heterogeneous` medium in [0, 1]^3, moved by `to_world`; everywhere as "
    "its albedo or emission, or in a `homogeneous` medium; also written as a plain `<rgb>` or `<float>`")
template <class V, Of<ConstVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "value", .doc = "the value", .range = kNonNegative}, s.value);
  v.field({.name = "to_world", .doc = "moves the cube [0, 1]^3 that it fills as a density"}, s.to_world);
}

LS_TYPE(GridVolume, "volume", "gridvolume", "", "values on a grid, from a file")
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
  v.field({.name = "wrap_mode",
           .doc = "what a `.vol` continues with beyond its outermost voxels' centres, and as an albedo "
                  "beyond its box; a density ends there"},
          s.wrap);
  v.field(
      {.name = "use_grid_bbox", .doc = "place the grid by the bounding box in its file instead of [0, 1]^3"},
      s.use_grid_bbox);
  v.field({.name = "node_centred",
           .doc = "the outermost values sit on the faces of the box instead of half a voxel inside it; true "
                  "in files of version 0.x; not for `.vdb`"},
          s.node_centred);
  v.field({.name = "border",
           .doc = "the box ends at the inner faces of the outermost voxels, which only take part in the "
                  "interpolation; of a `.vol` alone. Not in Mitsuba",
           .elided = true},
          s.border);
  v.field({.name = "raw", .doc = "no colour conversion; without effect, as volumes are linear RGB here"},
          s.raw);
  v.field({.name = "to_world", .doc = "places the grid's box in the world"}, s.to_world);
  v.field({.name = "order", .doc = "which index of a `.bin` file's values runs fastest"}, s.order);
}

LS_TYPE(IsotropicPhase, "phase", "isotropic", "",
        "scatters equally into all directions; what a medium has if none is given")
template <class V, Of<IsotropicPhase> T>
void describe(V&, T&) {}

LS_TYPE(HgPhase, "phase", "hg", "", "Henyey-Greenstein")
template <class V, Of<HgPhase> T>
void describe(V& v, T& p) {
  v.field({.name = "g", .doc = "mean cosine; positive: forwards", .range = kMeanCosine}, p.g);
}
template <class V>
void describe_priority(V& v, auto& priority) {
  v.field({.name = "priority",
           .doc = "where media overlap, those of the highest priority are there and the others are not; "
                  "equal ones add up. Not in Mitsuba",
           .range = {-1000000, 1000000},
           .unwritten = 0,
           .elided = true},
          priority);
}

LS_TYPE(HomogeneousMedium, "medium", "homogeneous", "", "the same everywhere")
template <class V, Of<HomogeneousMedium> T>
void describe(V& v, T& m) {
  v.field({.name = "sigma_t",
           .doc = "extinction",
           .unit = "1/length",
           .range = kNonNegative,
           .constvolume = true},
          m.sigma_t);
  v.field({.name = "albedo",
           .doc = "share of extinction that is scattering; with a grid it becomes a `heterogeneous` medium "
                  "of one density within 1e9 of the origin",
           .range = kUnit,
           .constvolume = true},
          m.albedo);
  v.field({.name = "scale", .doc = "factor on sigma_t", .range = kNonNegative}, m.scale);
  v.field(nested_field("phase", "how light is scattered; `isotropic` if there is none", "<phase>"), m.phase);
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
  v.field(kLightGroup, m.light_group);
  v.field(link_sets_field("link sets that the medium is in, for `receivers` of lights: names, separated by "
                          "commas; letters, digits, `_` and `-`. Not in Mitsuba"),
          m.link_sets);
}

LS_TYPE(HeterogeneousMedium, "medium", "heterogeneous", "", "varies in space by volumes")
template <class V, Of<HeterogeneousMedium> T>
void describe(V& v, T& m) {
  v.field(quantity("sigma_t", "extinction", "1/length", kNonNegative), m.sigma_t);
  v.field({.name = "albedo",
           .doc = "share of extinction that is scattering",
           .range = kUnit,
           .fallback = {.75, .75, .75}},
          m.albedo);
  v.field({.name = "scale", .doc = "factor on sigma_t", .range = kNonNegative}, m.scale);
  v.field({.name = "tint",
           .doc = "factor on sigma_t by colour; not for a grid of three channels. Not in Mitsuba",
           .range = kNonNegative,
           .constvolume = true,
           .unwritten = 1,
           .elided = true},
          m.tint);
  v.field(nested_field("phase", "how light is scattered; `isotropic` if there is none", "<phase>"), m.phase);
  v.field(
      quantity("emission",
               "light given off, whatever the extinction; a grid ends at its box, one value is everywhere "
               "in the medium",
               "radiance/length", kNonNegative),
      m.emission);
  v.field(quantity("source_radiance", "light given off per absorption: sigma_a times this", "radiance",
                   kNonNegative),
          m.source_radiance);
  v.field(quantity("temperature",
                   "the medium glows as a black body: sigma_a times its radiance at temperature_offset + "
                   "temperature_scale * this",
                   "K", kNonNegative),
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
  v.field({.name = "temperature_offset",
           .doc = "added to it",
           .unit = "K",
           .range = {-kMaxTemperature, kMaxTemperature},
           .unwritten = 0},
          m.temperature_offset);
  v.field({.name = "peak_one",
           .doc = "divides the spectrum of each black body by its largest value, as pbrt does: `temperature` "
                  "then gives the colour, and `emission_scale` the brightness. Not in Mitsuba",
           .elided = true},
          m.peak_one);
  v.field({.name = "emission_weight",
           .doc = "factor on the light of `temperature`; a grid ends at its box. Not in Mitsuba",
           .range = kNonNegative,
           .elided = true},
          m.emission_weight);
  describe_priority(v, m.priority);
  v.field(kLightGroup, m.light_group);
  v.field(link_sets_field("link sets that the medium is in, for `receivers` of lights: names, separated by "
                          "commas; letters, digits, `_` and `-`. Not in Mitsuba"),
          m.link_sets);
}

}  // namespace ls::scene
