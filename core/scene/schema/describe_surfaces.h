// The parameters of textures and surfaces, with ranges, defaults and documentation (describe.h).
#pragma once

#include "core/scene/schema/describe.h"

namespace ls::scene {

LS_TYPE(ConstantTexture, "texture", "constant", "uniform, srgb",
        "one colour; also written as a plain `<rgb>`, `<float>` or `<spectrum>`")
template <class V, Of<ConstantTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "value", .doc = "the colour"}, t.value);
}

LS_TYPE(BitmapTexture, "texture", "bitmap", "",
        "an image: PNG, JPEG, BMP, TGA, QOI, EXR, HDR, PFM or IES; (u, v) = (0, 0) is its upper left corner")
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
  v.field(image_colours_field(), t.colours);
}

LS_TYPE(CheckerboardTexture, "texture", "checkerboard", "", "two colours in alternation")
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

LS_TYPE(PeakTexture, "texture", "peak", "",
        "the largest channel of another texture, or its colour divided by that; not in Mitsuba: Nori's "
        "`microfacet_tex` is made of it")
template <class V, Of<PeakTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "texture", .doc = "the texture", .range = kNonNegative}, t.texture);
  v.field({.name = "hue", .doc = "the colour divided by its largest channel, white where it is black"},
          t.hue);
}

LS_TYPE(ProductTexture, "texture", "product", "",
        "the product of two textures, or where that is large enough; not in Mitsuba: factors and cut-outs of "
        "glTF are made of it")
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

LS_TYPE(MeshAttributeTexture, "texture", "mesh_attribute", "",
        "what a `ply` mesh carries at its vertices, interpolated over each triangle, or at its faces: one "
        "number or three. Its properties `r g b` or `red green blue` (maybe with an `alpha`, left out) are "
        "the attribute `color`; one or three of a kind like `foo_x foo_y foo_z`, `foo_0 foo_1 foo_2` or "
        "`foo_1 foo_2 foo_3` are `foo`; `foo_r foo_g foo_b` are `foo_color`. As in Mitsuba 3.9, floats count "
        "as they are, `uchar` from 0 to 255 (so give `scale` = 1/255), and other whole numbers as sRGB codes")
template <class V, Of<MeshAttributeTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "name", .doc = "of the attribute, with `vertex_` or `face_` in front", .required = true},
          t.name);
  v.field({.name = "scale", .doc = "multiplies it", .range = kNonNegative}, t.scale);
}

// Describes the parameter multiple_scattering, which several rough surfaces have.
inline Field multiple_scattering_field(std::string_view doc) {
  return {.name = "multiple_scattering", .doc = doc, .elided = true};
}
template <class V, class T>
void describe_multiple_scattering(V& v, T& b) {
  v.field(multiple_scattering_field("our own: light that microfacets throw onto each other is not lost (see "
                                    "docs/design/multiple-scattering.md); needs one roughness that is no "
                                    "texture"),
          b.multiple_scattering);
}

// Describes the microfacet distribution and the roughnesses along u and v, which several rough BSDFs have.
template <class V, class T>
void describe_roughness(V& v, T& b) {
  v.field({.name = "distribution", .doc = "of the microfacets' normals"}, b.distribution);
  v.field(number_field("alpha_u", "roughness along u", kPositive, .1), b.alpha_u);
  v.field(number_field("alpha_v", "roughness along v", kPositive, .1), b.alpha_v);
}

template <class V, class T>
void describe_metal(V& v, T& b) {
  v.field(
      {.name = "eta", .doc = "real part of the index of refraction; or `material`", .range = kNonNegative},
      b.eta);
  v.field({.name = "k", .doc = "imaginary part; or `material`", .range = kNonNegative}, b.k);
  v.field({.name = "specular_reflectance", .doc = "factor on the reflection", .range = kUnit},
          b.specular_reflectance);
}

// Describes the parameters of a dielectric interface or of a thin dielectric sheet. `outside` and `through`
// are the texts that document ext_ior and specular_transmittance.
template <class V, class T>
void describe_glass(V& v, T& b, std::string_view outside, std::string_view through) {
  v.field({.name = "int_ior", .doc = "index of refraction inside", .range = kPositive, .named_ior = true},
          b.int_ior);
  v.field({.name = "ext_ior", .doc = outside, .range = kPositive, .named_ior = true}, b.ext_ior);
  v.field({.name = "specular_reflectance", .doc = "factor on the reflection", .range = kUnit},
          b.specular_reflectance);
  v.field({.name = "specular_transmittance", .doc = through, .range = kUnit}, b.specular_transmittance);
}

// Describes a dielectric coat and the base under it.
template <class V, class T>
void describe_coat(V& v, T& b) {
  v.field(
      {.name = "int_ior", .doc = "index of refraction of the coat", .range = kPositive, .named_ior = true},
      b.int_ior);
  v.field({.name = "ext_ior", .doc = "index of refraction outside", .range = kPositive, .named_ior = true},
          b.ext_ior);
  v.field({.name = "nonlinear", .doc = "colour shifts by internal reflection"}, b.nonlinear);
  v.field({.name = "diffuse_reflectance", .doc = "of the base", .range = kUnit, .fallback = {.5, .5, .5}},
          b.diffuse_reflectance);
  v.field({.name = "specular_reflectance", .doc = "factor on the coat's reflection", .range = kUnit},
          b.specular_reflectance);
}

LS_TYPE(DiffuseBsdf, "bsdf", "diffuse", "", "ideally rough surface, one-sided unless wrapped in `twosided`")
template <class V, Of<DiffuseBsdf> T>
void describe(V& v, T& b) {
  v.field(
      {.name = "reflectance", .doc = "share of light sent back", .range = kUnit, .fallback = {.5, .5, .5}},
      b.reflectance);
}

LS_TYPE(DiffuseTransmissionBsdf, "bsdf", "diffusetransmission", "",
        "an ideally rough thin sheet, such as a leaf, paper or cloth: light leaves it on both sides")
template <class V, Of<DiffuseTransmissionBsdf> T>
void describe(V& v, T& b) {
  v.field({.name = "reflectance",
           .doc = "share of light sent back; with the transmittance at most 1. Where images exceed that, "
                  "both are divided by the sum",
           .range = kUnit,
           .fallback = {.25, .25, .25}},
          b.reflectance);
  v.field({.name = "transmittance",
           .doc = "share of light that leaves on the other side",
           .range = kUnit,
           .fallback = {.25, .25, .25}},
          b.transmittance);
}

LS_TYPE(ConductorBsdf, "bsdf", "conductor", "", "smooth metal")
template <class V, Of<ConductorBsdf> T>
void describe(V& v, T& b) {
  describe_metal(v, b);
}

LS_TYPE(RoughConductorBsdf, "bsdf", "roughconductor", "",
        "rough metal; `alpha` sets both alpha_u and alpha_v")
template <class V, Of<RoughConductorBsdf> T>
void describe(V& v, T& b) {
  describe_roughness(v, b);
  describe_metal(v, b);
  describe_multiple_scattering(v, b);
}

LS_TYPE(DielectricBsdf, "bsdf", "dielectric", "", "smooth boundary of glass, water or the like")
template <class V, Of<DielectricBsdf> T>
void describe(V& v, T& b) {
  describe_glass(v, b, "index of refraction outside", "factor on the refraction");
}

LS_TYPE(RoughDielectricBsdf, "bsdf", "roughdielectric", "",
        "rough boundary of glass, water or the like; `alpha` sets both alpha_u and alpha_v. Indices within a "
        "thousandth of each other, or a roughness below one, make it a `dielectric`")
template <class V, Of<RoughDielectricBsdf> T>
void describe(V& v, T& b) {
  describe_roughness(v, b);
  describe_glass(v, b, "index of refraction outside", "factor on the refraction");
  describe_multiple_scattering(v, b);
}

LS_TYPE(ThinDielectricBsdf, "bsdf", "thindielectric", "",
        "a sheet of glass as one surface, reflections within the sheet included: light passes straight on, "
        "which counts as no scattering")
template <class V, Of<ThinDielectricBsdf> T>
void describe(V& v, T& b) {
  describe_glass(v, b, "index of refraction around", "factor on what passes");
}

LS_TYPE(RoughThinDielectricBsdf, "bsdf", "roughthindielectric", "",
        "a sheet of glass with rough sides as one surface, reflections within the sheet included: light that "
        "passes leaves in the directions of reflected light, mirrored at the sheet. `alpha` sets both "
        "alpha_u and alpha_v. Where both are below a thousandth it is a `thindielectric`")
template <class V, Of<RoughThinDielectricBsdf> T>
void describe(V& v, T& b) {
  describe_roughness(v, b);
  describe_glass(v, b, "index of refraction around", "factor on what passes");
  describe_multiple_scattering(v, b);
}

LS_TYPE(PlasticBsdf, "bsdf", "plastic", "", "diffuse base under a smooth dielectric coat")
template <class V, Of<PlasticBsdf> T>
void describe(V& v, T& b) {
  describe_coat(v, b);
}

LS_TYPE(RoughPlasticBsdf, "bsdf", "roughplastic", "", "diffuse base under a rough dielectric coat")
template <class V, Of<RoughPlasticBsdf> T>
void describe(V& v, T& b) {
  v.field({.name = "distribution", .doc = "of the microfacets' normals"}, b.distribution);
  v.field({.name = "alpha", .doc = "roughness", .range = kPositive}, b.alpha);
  describe_coat(v, b);
  describe_multiple_scattering(v, b);
}

LS_TYPE(CoatedConductorBsdf, "bsdf", "coatedconductor", "",
        "metal under a dielectric coat, GGX facets on both (docs/design/coated-metal.md); `alpha` sets both "
        "alpha_u and alpha_v. A roughness below a thousandth is smooth, and without a contrast of indices it "
        "is the metal alone. Our own: Mitsuba has no such plugin")
template <class V, Of<CoatedConductorBsdf> T>
void describe(V& v, T& b) {
  v.field(
      {.name = "int_ior", .doc = "index of refraction of the coat", .range = kPositive, .named_ior = true},
      b.int_ior);
  v.field({.name = "ext_ior", .doc = "index of refraction outside", .range = kPositive, .named_ior = true},
          b.ext_ior);
  v.field({.name = "coat_alpha", .doc = "roughness of the coat; 0 is smooth", .range = kNonNegative},
          b.coat_alpha);
  v.field({.name = "alpha_u", .doc = "roughness of the metal along u; 0 is smooth", .range = kNonNegative},
          b.alpha_u);
  v.field({.name = "alpha_v", .doc = "roughness of the metal along v", .range = kNonNegative}, b.alpha_v);
  v.field(
      {.name = "eta",
       .doc = "real part of the metal's index of refraction, of which int_ior is divided out; or `material`",
       .range = kNonNegative},
      b.eta);
  v.field({.name = "k", .doc = "imaginary part, likewise; or `material`", .range = kNonNegative}, b.k);
  v.field({.name = "specular_reflectance", .doc = "factor on the metal's reflection", .range = kUnit},
          b.specular_reflectance);
}

LS_TYPE(NullBsdf, "bsdf", "null", "", "index-matched boundary of a medium: light passes unchanged")
template <class V, Of<NullBsdf> T>
void describe(V&, T&) {}

LS_TYPE(TwoSidedBsdf, "bsdf", "twosided", "",
        "gives each side of a surface a bsdf; one nested bsdf serves both")
template <class V, Of<TwoSidedBsdf> T>
void describe(V& v, T& b) {
  v.field(nested_field("front", "of the front", "<bsdf>"), b.front);
  v.field(nested_field("back", "of the back; the first again if there is no second", "<bsdf>"), b.back);
}

LS_TYPE(MaskBsdf, "bsdf", "mask", "",
        "lets a share of the light pass straight on, shadows included; that counts as no scattering, and an "
        "emitter on the surface is not masked")
template <class V, Of<MaskBsdf> T>
void describe(V& v, T& b) {
  v.field(number_field(
              "opacity",
              "1: nothing passes. Of an image its alpha channel, if that falls below 1/2 somewhere; else "
              "the luminance",
              kUnit, .5),
          b.opacity);
  v.field(nested_field("bsdf", "of the opaque share", "<bsdf>"), b.bsdf);
}

LS_TYPE(BlendBsdf, "bsdf", "blendbsdf", "", "a mixture of two bsdfs")
template <class V, Of<BlendBsdf> T>
void describe(V& v, T& b) {
  v.field(number_field("weight", "share of the second bsdf; the luminance of a colour", kUnit, .5), b.weight);
  v.field(nested_field("first", "where the weight is 0", "<bsdf>"), b.first);
  v.field(nested_field("second", "where the weight is 1", "<bsdf>"), b.second);
}

template <class V, class T>
void describe_map(V& v, T& b) {
  v.field(
      {.name = "flip_invalid_normals",
       .doc = "turn normals that face away from the viewer to the other side; false in files of version 0.x"},
      b.flip_invalid_normals);
  v.field({.name = "use_shadowing_function",
           .doc = "let steep places cast shadows, so that light ends softly; false in files of version 0.x"},
          b.use_shadowing_function);
}

LS_TYPE(NormalMapBsdf, "bsdf", "normalmap", "",
        "turns the normal that a bsdf sees by an image (`raw` as a rule); light that the turned and the true "
        "normal put on different sides is left out")
template <class V, Of<NormalMapBsdf> T>
void describe(V& v, T& b) {
  v.field({.name = "normalmap",
           .doc = "normals: (x, y, z) = 2 (r, g, b) - 1 along u, across it and along the surface's normal",
           .range = kUnit,
           .fallback = {.5, .5, 1}},
          b.normalmap);
  v.field(nested_field("bsdf", "that sees them", "<bsdf>"), b.bsdf);
  describe_map(v, b);
  v.field(
      {.name = "follow_mirroring",
       .doc = "our own: green leans to the top of the image, also where texture coordinates or `to_world` "
              "mirror the image on the surface (as in glTF, USD and Blender); else it leans the other way "
              "there, as in Mitsuba",
       .elided = true},
      b.follow_mirroring);
}

LS_TYPE(BumpMapBsdf, "bsdf", "bumpmap", "",
        "turns the normal that a bsdf sees as if the surface were lifted by the luminance of an image, its "
        "`texture` (`raw` as a rule; bilinear, or else it is flat), which may also carry another name or "
        "none; light that the turned and the true normal put on different sides is left out")
template <class V, Of<BumpMapBsdf> T>
void describe(V& v, T& b) {
  v.field({.name = "texture", .doc = "heights, a `bitmap`", .fallback = {0, 0, 0}}, b.texture);
  v.field({.name = "scale", .doc = "multiplies the heights", .unit = "length"}, b.scale);
  v.field(nested_field("bsdf", "that sees the slopes", "<bsdf>"), b.bsdf);
  describe_map(v, b);
}

// Returns the field of a scalar texture from 0 to 1, which is 0 if it is not given.
inline Field share_field(std::string_view name, std::string_view doc) {
  return number_field(name, doc, kUnit, 0);
}

LS_TYPE(PrincipledBsdf, "bsdf", "principled", "",
        "Burley's model of metals, coated dielectrics and glass. `specular` instead of `eta` means eta = 2 / "
        "(1 - sqrt(0.08 specular)) - 1")
template <class V, Of<PrincipledBsdf> T>
void describe(V& v, T& b) {
  v.field({.name = "base_color", .doc = "the colour", .range = kUnit, .fallback = {.5, .5, .5}},
          b.base_color);
  v.field(number_field("roughness", "its square is GGX's alpha", kUnit, .5), b.roughness);
  v.field(share_field("anisotropic", "stretches highlights along u"), b.anisotropic);
  v.field(share_field("metallic", "share of metal"), b.metallic);
  v.field({.name = "spec_trans",
           .doc = "share of glass in what is not metal; not given, or 0, it has one side",
           .range = kUnit,
           .number = true},
          b.spec_trans);
  v.field({.name = "eta", .doc = "index of refraction inside over that outside", .range = kPositive}, b.eta);
  v.field(share_field("spec_tint", "how far the colour tints the reflection"), b.spec_tint);
  v.field(share_field("sheen", "of cloth, at grazing angles"), b.sheen);
  v.field(share_field("sheen_tint", "how far the colour tints it"), b.sheen_tint);
  v.field(share_field("flatness", "from diffuse to an imitation of light that scatters below"), b.flatness);
  v.field(share_field("clearcoat", "of a thin coat"), b.clearcoat);
  v.field(share_field("clearcoat_gloss", "of the coat"), b.clearcoat_gloss);
  v.field(multiple_scattering_field("our own: light that microfacets throw onto each other is not lost (see "
                                    "docs/design/multiple-scattering.md); without `anisotropic`"),
          b.multiple_scattering);
}

}  // namespace ls::scene
