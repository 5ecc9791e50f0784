// The parameters of textures, with ranges, defaults and documentation (describe.h).
#pragma once

#include "common/scene/schema/describe.h"

namespace ls::scene {

LS_TYPE(ConstantTexture, "texture", "constant", "uniform, srgb",
        "one colour; also written as a plain `<rgb>`, `<float>` or `<spectrum>`")
template <class V, Of<ConstantTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "value", .doc = "the colour"}, t.value);
}

LS_TYPE(BitmapTexture, "texture", "bitmap", "",
        "an image: PNG, JPEG, BMP, TGA, QOI, EXR, HDR or PFM; (u, v) = (0, 0) is its upper left corner")
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

LS_TYPE(
    MeshAttributeTexture, "texture", "mesh_attribute", "",
    "what a `ply` mesh carries at its vertices, interpolated over each triangle, or at its faces: one "
    "number or three. Its properties `r g b` or `red green blue` (maybe with an `alpha`, left out) are the "
    "attribute `color`; one or three of a kind like `foo_x foo_y foo_z`, `foo_0 foo_1 foo_2` or `foo_1 "
    "foo_2 foo_3` are `foo`; `foo_r foo_g foo_b` are `foo_color`. As in Mitsuba 3.9, floats count as they "
    "are, `uchar` from 0 to 255 (so give `scale` = 1/255), and other whole numbers as sRGB codes")
template <class V, Of<MeshAttributeTexture> T>
void describe(V& v, T& t) {
  v.field({.name = "name", .doc = "of the attribute, with `vertex_` or `face_` in front", .required = true},
          t.name);
  v.field({.name = "scale", .doc = "multiplies it", .range = kNonNegative}, t.scale);
}

}  // namespace ls::scene
