// Translates textures, and parameters that may be textures.
#include <fmt/format.h>

#include "formats/file_names.h"
#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

// Returns the texture that a parameter names, or a constant texture of its value; nullopt: the parameter is
// wrong, which was reported.
std::optional<Texture> texture_of(Translation& t, TextureOf what, const Param& p) {
  if (p.type != "texture") {
    const auto c = surface_colour(t, p);
    return c ? std::optional(Texture{*c, {}}) : std::nullopt;
  }
  if (p.texts.size() != 1)
    return t.report.refuse(p.at, fmt::format("'{}' wants the name of one texture", p.name));
  const Texture* found = find_texture(t, what, p.texts[0]);
  return found ? std::optional(*found)
               : t.report.refuse(p.at, fmt::format("no Texture \"{}\" stands before this", p.texts[0]));
}

// Returns which textures a parameter of this name takes.
TextureOf wanted(const Params& p, std::string_view name) {
  return p.row().find(name)->types.find("rgb") == std::string_view::npos ? TextureOf::numbers
                                                                         : TextureOf::colours;
}

void give(Element& parent, std::string_view name, const Texture& texture, const Span& at) {
  if (texture.value)
    add(parent, std::string(name), *texture.value, at);
  else
    refer(parent, name, texture.id, at);
}

std::optional<Texture> texture_of(Translation& t, TextureOf what, Params& p, std::string_view name,
                                  double fallback) {
  const Param* given = p.take(name);
  if (!given) return Texture{Rgb{fallback, fallback, fallback}, {}};
  return texture_of(t, what, *given);
}

// Adds the transform of (u, v). pbrt's v points up in the image, ours down.
void map_uv(Params& p, Element& out, double factor, bool turn_v) {
  if (const std::string kind = p.text("mapping", "uv"); kind != "uv")
    p.error(p.at(),
            fmt::format("{} has the mapping \"{}\", only uv is read: give the mesh uv", p.title(), kind));
  const double su = factor * p.number("uscale", 1), sv = factor * p.number("vscale", 1);
  const double du = factor * p.number("udelta", 0), dv = factor * p.number("vdelta", 0);
  const std::array<double, 16> m{su, 0, 0, du, 0, turn_v ? -sv : sv, 0, turn_v ? 1 - dv : dv, 0, 0, 1,
                                 0,  0, 0, 0,  1};
  if (Transform{m} == Transform{}) return;
  add_transform(out, nullptr, "to_uv", {matrix_step(m, out.at)});
}

Element image(Translation& t, Params& p) {
  Element out = made("texture", "bitmap", p.at());
  const std::string file = p.text("filename", "");
  if (file.empty()) p.missing("filename");
  if (file.ends_with(".ptx"))
    p.error(p.at(),
            fmt::format("images that end in .ptx are not read: turn \"{}\" into a PNG or an EXR", file));
  add(out, "string", "filename", file, p.at());
  const std::string filter = p.text("filter", "bilinear");
  if (filter == "point")
    add(out, "string", "filter_type", "nearest", p.at());
  else if (filter != "bilinear")
    t.warn_once(p.at(),
                fmt::format("the filter \"{}\" of {} is read as \"bilinear\": images are not filtered "
                            "over pixels here, which takes more samples for the same picture",
                            filter, p.title()));
  const std::string wrap = p.text("wrap", "repeat");
  if (wrap != "repeat") add(out, "string", "wrap_mode", wrap, p.at());
  const std::string encoding = p.text("encoding", "sRGB");
  // In pbrt `encoding` applies to PNG files only: all other 8-bit files are decoded as sRGB.
  if (encoding == "linear" && has_ending(file, {".png"})) add(out, "boolean", "raw", "true", p.at());
  if (encoding != "linear" && encoding != "sRGB")
    p.error(p.at(),
            fmt::format("{} has the encoding \"{}\": convert the image to sRGB", p.title(), encoding));
  if (p.boolean("invert", false))
    p.error(p.at(), fmt::format("{} is inverted: do that to the image itself", p.title()));
  map_uv(p, out, 1, true);
  return out;
}

// Translates a checkerboard. With the mapped coordinates (s, t), the squares follow in pbrt from
// floor(s) + floor(t), here from floor(2 s) + floor(2 t), so the coordinates are halved.
std::optional<Element> checks(Translation& t, TextureOf what, Params& p) {
  Element out = made("texture", "checkerboard", p.at());
  const auto one = texture_of(t, what, p, "tex1", 1), two = texture_of(t, what, p, "tex2", 0);
  if (p.integer("dimension", 2) != 2)
    p.error(p.at(),
            fmt::format("{} has another dimension than 2: solid textures are not known here", p.title()));
  map_uv(p, out, .5, false);
  if (!one || !two) return std::nullopt;
  give(out, "color0", *one, p.at());
  give(out, "color1", *two, p.at());
  return out;
}

Element product_of(const Texture& one, const Texture& other, const Span& at) {
  Element out = made("texture", "product", at);
  give(out, "first", one, at);
  give(out, "second", other, at);
  return out;
}

// Makes the element the texture of this name.
Texture made_texture(Translation& t, TextureOf what, const std::string& name, Element e) {
  const Texture texture{std::nullopt,
                        fmt::format("{}texture {}", what == TextureOf::numbers ? "float " : "", name)};
  set(e, "id", texture.id, e.at);
  add(t.scene, std::move(e));
  return texture;
}

std::optional<Texture> product(Translation& t, TextureOf what, const std::string& name, Params& p) {
  auto tex = texture_of(t, what, p, "tex", 1), scale = texture_of(t, TextureOf::numbers, p, "scale", 1);
  if (!tex || !scale) return std::nullopt;
  if (tex->value && scale->value) {
    for (std::size_t i = 0; i < 3; ++i) (*tex->value)[i] *= (*scale->value)[i];
    return tex;
  }
  if (scale->value == Rgb{1, 1, 1}) return tex;
  if (tex->value == Rgb{1, 1, 1}) return scale;
  return made_texture(t, what, name, product_of(*tex, *scale, p.at()));
}

std::optional<Texture> scaled_image(Translation& t, TextureOf what, const std::string& name, Params& p) {
  const double scale = p.number("scale", 1);
  Element read = image(t, p);
  if (scale == 1) return made_texture(t, what, name, std::move(read));
  const Texture unscaled = made_texture(t, what, name + " unscaled", std::move(read));
  return made_texture(t, what, name, product_of(Texture{Rgb{scale, scale, scale}, {}}, unscaled, p.at()));
}

}  // namespace

void refer(Element& parent, std::string_view name, std::string id, const Span& at) {
  Element ref = made("ref", "", at);
  if (!name.empty()) set(ref, "name", std::string(name), at);
  set(ref, "id", std::move(id), at);
  add(parent, std::move(ref));
}

const Texture* find_texture(const Translation& t, TextureOf what, const std::string& name) {
  const bool numbers = what == TextureOf::numbers;
  for (const auto* all :
       {numbers ? &t.float_textures : &t.colour_textures, numbers ? &t.colour_textures : &t.float_textures})
    if (const auto found = all->find(name); found != all->end()) return &found->second;
  return nullptr;
}

void set_texture(Translation& t, TextureOf what, const std::string& name, Texture texture) {
  (what == TextureOf::numbers ? t.float_textures : t.colour_textures).emplace(name, std::move(texture));
}

void add_texture(Translation& t, TextureOf what, const std::string& name, Params& p) {
  if ((what == TextureOf::numbers ? t.float_textures : t.colour_textures).contains(name))
    return t.report.error(p.at(), fmt::format("a second Texture \"{}\" of the type \"{}\": names of textures "
                                              "of one type differ in pbrt-v4",
                                              name, what == TextureOf::numbers ? "float" : "spectrum"));
  std::optional<Texture> texture;
  const std::string_view type = p.row().type;
  if (type == "constant") {
    texture = texture_of(t, what, p, "value", 1);
  } else if (type == "scale") {
    texture = product(t, what, name, p);
  } else if (type == "imagemap") {
    texture = scaled_image(t, what, name, p);
  } else if (auto made = checks(t, what, p)) {
    texture = made_texture(t, what, name, std::move(*made));
  }
  p.finish();
  set_texture(t, what, name, texture.value_or(Texture{Rgb{1, 1, 1}, {}}));
}

void add_value(Translation& t, Element& parent, Params& p, Names names, const Rgb& fallback) {
  const Param* given = p.take(names.theirs);
  if (!given) return add(parent, std::string(names.ours), fallback, p.at());
  if (const auto texture = texture_of(t, wanted(p, names.theirs), *given))
    give(parent, names.ours, *texture, given->at);
}

void add_scaled_value(Translation& t, Element& parent, Params& p, std::string_view name, const Rgb& fallback,
                      double scale) {
  const Param* given = p.take(name);
  auto texture = given ? texture_of(t, wanted(p, name), *given) : Texture{fallback, {}};
  if (!texture) return;
  const Span at = given ? given->at : p.at();
  if (texture->value)
    for (double& x : *texture->value) x *= scale;
  if (texture->value || scale == 1) return give(parent, name, *texture, at);
  Element product = product_of(Texture{Rgb{scale, scale, scale}, {}}, *texture, at);
  set(product, "name", std::string(name), at);
  add(parent, std::move(product));
}

}  // namespace ls::scene::pbrt
