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

// Describes the box of a volume of noise.
template <class V, class T>
void describe_noise_box(V& v, T& s) {
  v.field(
      {.name = "min", .doc = "corner of the box that it fills as a density or as light", .given_as = "point"},
      s.min);
  v.field({.name = "max", .doc = "the opposite corner", .given_as = "point"}, s.max);
  v.field({.name = "to_world", .doc = "moves it, with its box"}, s.to_world);
}

LS_TYPE(HeightFogVolume, "volume", "heightfog", "",
        "a value that falls with height, to 1/e over `height`; below the ground it is that of the ground. It "
        "has no end. As the `sigma_t` of a `heterogeneous` medium whose other volumes are constant it is as "
        "cheap as a `homogeneous` medium, as rays are followed through it by formulas. Not in Mitsuba")
template <class V, Of<HeightFogVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "value", .doc = "at the ground", .range = kNonNegative}, s.value);
  v.field(
      {.name = "height", .doc = "over which the value falls to 1/e", .unit = "length", .range = kPositive},
      s.height);
  v.field({.name = "ground_point", .doc = "a point of the ground, which is a plane", .given_as = "point"},
          s.ground_point);
  v.field({.name = "ground_normal", .doc = "upwards; of any length", .given_as = "vector"}, s.ground_normal);
  v.field({.name = "to_world", .doc = "moves the ground; a scale along its normal scales `height` too"},
          s.to_world);
}

LS_TYPE(
    NoiseVolume, "volume", "noise", "",
    "noise in octaves (Perlin's, with hashed gradients), from `low` to `high`, most of it near their mean. "
    "As a density or as light it fills its box; as anything else, or a part of another volume, it is "
    "everywhere. Not in Mitsuba")
template <class V, Of<NoiseVolume> T>
void describe(V& v, T& s) {
  constexpr double kFar = 1e6;
  v.field({.name = "scale",
           .doc = "cells of the first octave along a unit of length",
           .unit = "1/length",
           .range = {.min = 0, .max = kFar, .open_min = true}},
          s.scale);
  v.field({.name = "octaves", .doc = "number of octaves", .range = {.min = 1, .max = kMaxNoiseOctaves}},
          s.octaves);
  v.field({.name = "lacunarity", .doc = "cells per cell of the octave before", .range = {.min = 1, .max = 8}},
          s.lacunarity);
  v.field({.name = "gain", .doc = "strength relative to the octave before", .range = kUnit}, s.gain);
  v.field({.name = "offset",
           .doc = "added to the position, in cells of the first octave",
           .range = {.min = -kFar, .max = kFar},
           .given_as = "vector"},
          s.offset);
  v.field({.name = "seed", .doc = "another seed is another noise"}, s.seed);
  v.field({.name = "low",
           .doc = "the least value; below 0 it makes holes, as values below 0 are 0",
           .range = {.min = -kFar, .max = kFar}},
          s.low);
  v.field({.name = "high", .doc = "the largest value", .range = {.min = 0, .max = kFar}}, s.high);
  describe_noise_box(v, s);
}

LS_TYPE(
    CloudVolume, "volume", "cloud", "",
    "pbrt's cloud: noise that thins out with the height y, 1 at y = 0 and about 0 at y = 1, with edges that "
    "another noise frays. As a density or as light it fills its box; as anything else, or a part of another "
    "volume, it is everywhere. Not in Mitsuba")
template <class V, Of<CloudVolume> T>
void describe(V& v, T& s) {
  constexpr double kMost = 1e6;
  v.field({.name = "density", .doc = "factor on the noise", .range = {.min = -kMost, .max = kMost}},
          s.density);
  v.field({.name = "wispiness", .doc = "how far edges are frayed", .range = {.min = 0, .max = kMost}},
          s.wispiness);
  v.field({.name = "frequency",
           .doc = "cells of the noise along a unit of length",
           .unit = "1/length",
           .range = {.min = -kMost, .max = kMost}},
          s.frequency);
  describe_noise_box(v, s);
}

LS_TYPE(ProductVolume, "volume", "product", "",
        "the product of two volumes of one channel each; it fills the box of the first of them that has one. "
        "Not in Mitsuba")
template <class V, Of<ProductVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "first", .doc = "a number or a volume; a grid is 0 beyond its box", .range = kNonNegative},
          s.first);
  v.field({.name = "second", .doc = "likewise", .range = kNonNegative}, s.second);
}

LS_TYPE(
    RemapVolume, "volume", "remap", "",
    "another volume of one channel, mapped: t = (value - in_low) / (in_high - in_low), limited to [0, 1]; "
    "t to the power of `gamma`; the curve through points, if there are any; out_low + (out_high - out_low) "
    "t. It fills the box of the other volume. Not in Mitsuba")
template <class V, Of<RemapVolume> T>
void describe(V& v, T& s) {
  v.field({.name = "volume", .doc = "what is mapped", .range = kNonNegative, .required = true}, s.volume);
  v.field({.name = "in_low", .doc = "the value that becomes 0, with all below it"}, s.in_low);
  v.field({.name = "in_high", .doc = "the value that becomes 1, with all above it"}, s.in_high);
  v.field({.name = "gamma", .doc = "exponent", .range = {.min = 0, .max = 100, .open_min = true}}, s.gamma);
  v.field({.name = "positions",
           .doc = "ascending, at which the curve has its points; beyond the first and the last it is level",
           .range = kUnit,
           .elided = true},
          s.positions);
  v.field({.name = "values",
           .doc = "of the curve, as many as `positions`",
           .range = kNonNegative,
           .elided = true},
          s.values);
  v.field({.name = "out_low", .doc = "what 0 becomes", .range = kNonNegative}, s.out_low);
  v.field({.name = "out_high", .doc = "what 1 becomes", .range = kNonNegative}, s.out_high);
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
LS_TYPE(RayleighPhase, "phase", "rayleigh", "",
        "particles much smaller than the wavelength: 3/(16 pi) (1 + cos^2 of the scattering angle)")
template <class V, Of<RayleighPhase> T>
void describe(V&, T&) {}

LS_TYPE(DrainePhase, "phase", "draine", "",
        "Henyey-Greenstein times 1 + alpha cos^2 (Draine 2003): `alpha` 0 is `hg`; `g` 0 with `alpha` 1 is "
        "`rayleigh`")
template <class V, Of<DrainePhase> T>
void describe(V& v, T& p) {
  v.field({.name = "g", .doc = "as of `hg`; the mean cosine is a little larger", .range = kMeanCosine}, p.g);
  v.field({.name = "alpha", .doc = "weight of cos^2", .range = {.min = 0, .max = 1000}}, p.alpha);
}

LS_TYPE(DropletsPhase, "phase", "droplets", "",
        "water droplets of fog and clouds: Jendersie and d'Eon's fit (2023) to Mie's solution. It has the "
        "forward peak and a broad rise backwards, but no bow and no glory; for these see `tabphase`")
template <class V, Of<DropletsPhase> T>
void describe(V& v, T& p) {
  v.field({.name = "diameter",
           .doc = "of the droplets: mist and fog 2 to 20, clouds 10 to 40",
           .unit = "micrometres",
           .range = {.min = 1e-3, .max = 50}},
          p.diameter);
}

LS_TYPE(FournierForandPhase, "phase", "fournier_forand", "",
        "particles in sea water, of many sizes (Fournier and Forand 1994)")
template <class V, Of<FournierForandPhase> T>
void describe(V& v, T& p) {
  v.field({.name = "backscatter",
           .doc = "share of the light scattered by more than 90 degrees",
           .range = {.min = 1e-5, .max = .5}},
          p.backscatter);
  v.field({.name = "ior",
           .doc = "index of refraction of the particles, relative to the water",
           .range = {.min = 1.0001, .max = 5}},
          p.ior);
}

LS_TYPE(
    TabulatedPhase, "phase", "tabphase", "",
    "values at scattering angles (0 where light goes straight on), linear in the cosine between them: "
    "grey `values`, or `red`, `green` and `blue`. The values may have any scale, as each colour is scaled "
    "to an integral of 1 over all directions")
template <class V, Of<TabulatedPhase> T>
void describe(V& v, T& p) {
  const auto list = [&](std::string_view name, std::string_view doc, const Range& range, auto& numbers) {
    v.field({.name = name, .doc = doc, .range = range, .elided = true}, numbers);
  };
  list("values", "from straight back to straight on, unless `angles` says otherwise", kNonNegative, p.values);
  list("red", "the values of a colour each. Not in Mitsuba", kNonNegative, p.red);
  list("green", "with `red`", kNonNegative, p.green);
  list("blue", "with `red`", kNonNegative, p.blue);
  list("nodes",
       "cosines at which the values are, ascending from -1 to 1; if neither these nor `angles` are given, "
       "evenly spaced. Not in Mitsuba",
       {.min = -1, .max = 1}, p.nodes);
  list("angles", "angles at which the values are, in degrees, ascending from 0 to 180. Not in Mitsuba",
       {.min = 0, .max = 180}, p.angles);
}

LS_TYPE(BlendPhase, "phase", "blendphase", "", "a mixture of two phase functions")
template <class V, Of<BlendPhase> T>
void describe(V& v, T& p) {
  v.field({.name = "weight",
           .doc = "share of the second: a number, or a grid that says it at each place",
           .range = kUnit,
           .fallback = {.5, .5, .5}},
          p.weight);
  v.field(nested_field("first", "where the weight is 0", "<phase>"), p.first);
  v.field(nested_field("second", "where the weight is 1", "<phase>"), p.second);
}

// Describes the fields that all media have.
template <class V, class T>
void describe_common(V& v, T& m) {
  v.field({.name = "priority",
           .doc = "where media overlap, those of the highest priority are there and the others are not; "
                  "equal ones add up. Not in Mitsuba",
           .range = {-1000000, 1000000},
           .unwritten = 0,
           .elided = true},
          m.priority);
  v.field(kLightGroup, m.light_group);
  v.field(link_sets_field("link sets that the medium is in, for `receivers` of lights: names, separated by "
                          "commas; letters, digits, `_` and `-`. Not in Mitsuba"),
          m.link_sets);
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
  describe_common(v, m);
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
  describe_common(v, m);
}

}  // namespace ls::scene
