// Translates textures, and parameters that may be textures.
#include <fmt/format.h>

#include "common/scene/file_names.h"
#include "common/scene/pbrt/object_translation.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

// Returns the texture that a parameter names, or a constant texture of its value; nullopt: the parameter is
// wrong, which was reported.
std::optional<Texture> texture_of(Translation& t, const Param& p) {
  if (p.type != "texture") {
    const auto c = surface_colour(t, p);
    return c ? std::optional(Texture{*c, {}}) : std::nullopt;
  }
  const auto found = p.texts.size() == 1 ? t.textures.find(p.texts[0]) : t.textures.end();
  if (found != t.textures.end()) return found->second;
  return t.report.refuse(p.at, p.texts.size() == 1
                                   ? fmt::format("no Texture \"{}\" stands before this", p.texts[0])
                                   : fmt::format("'{}' wants the name of one texture", p.name));
}

void give(Element& parent, std::string_view name, const Texture& texture, const Span& at) {
  if (texture.value)
    add(parent, std::string(name), *texture.value, at);
  else
    refer(parent, name, texture.id, at);
}

std::optional<Texture> texture_of(Translation& t, Params& p, std::string_view name, double fallback) {
  const Param* given = p.take(name);
  if (!given) return Texture{Rgb{fallback, fallback, fallback}, {}};
  return texture_of(t, *given);
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

Element image(Params& p) {
  Element out = made("texture", "bitmap", p.at());
  const std::string file = p.text("filename", "");
  if (file.empty()) p.missing("filename");
  if (file.ends_with(".ptx"))
    p.error(p.at(),
            fmt::format("images that end in .ptx are not read: turn \"{}\" into a PNG or an EXR", file));
  add(out, "string", "filename", file, p.at());
  if (p.text("filter", "bilinear") == "point") add(out, "string", "filter_type", "nearest", p.at());
  const std::string wrap = p.text("wrap", "repeat");
  if (wrap != "repeat") add(out, "string", "wrap_mode", wrap, p.at());
  const std::string encoding = p.text("encoding", "sRGB");
  // In pbrt `encoding` applies to PNG files only: all other 8-bit files are decoded as sRGB.
  if (encoding == "linear" && has_ending(file, {".png"})) add(out, "boolean", "raw", "true", p.at());
  if (encoding != "linear" && encoding != "sRGB")
    p.error(p.at(),
            fmt::format("{} has the encoding \"{}\": convert the image to sRGB", p.title(), encoding));
  if (p.number("scale", 1) != 1 || p.boolean("invert", false))
    p.error(p.at(), fmt::format("{} has a scale or is inverted: do that to the image itself", p.title()));
  map_uv(p, out, 1, true);
  return out;
}

// Translates a checkerboard. With the mapped coordinates (s, t), the squares follow in pbrt from
// floor(s) + floor(t), here from floor(2 s) + floor(2 t), so the coordinates are halved.
std::optional<Element> checks(Translation& t, Params& p) {
  Element out = made("texture", "checkerboard", p.at());
  const auto one = texture_of(t, p, "tex1", 1), two = texture_of(t, p, "tex2", 0);
  if (p.integer("dimension", 2) != 2)
    p.error(p.at(),
            fmt::format("{} has another dimension than 2: solid textures are not known here", p.title()));
  map_uv(p, out, .5, false);
  if (!one || !two) return std::nullopt;
  give(out, "color0", *one, p.at());
  give(out, "color1", *two, p.at());
  return out;
}

std::optional<Texture> product(Translation& t, Params& p) {
  auto tex = texture_of(t, p, "tex", 1), scale = texture_of(t, p, "scale", 1);
  if (!tex || !scale) return std::nullopt;
  if (tex->value && scale->value) {
    for (std::size_t i = 0; i < 3; ++i) (*tex->value)[i] *= (*scale->value)[i];
    return tex;
  }
  if (scale->value == Rgb{1, 1, 1}) return tex;
  if (tex->value == Rgb{1, 1, 1}) return scale;
  return p.refuse(p.at(), fmt::format("{} multiplies an image: do that to the image itself", p.title()));
}

}  // namespace

void refer(Element& parent, std::string_view name, std::string id, const Span& at) {
  Element ref = made("ref", "", at);
  if (!name.empty()) set(ref, "name", std::string(name), at);
  set(ref, "id", std::move(id), at);
  add(parent, std::move(ref));
}

void add_texture(Translation& t, const std::string& name, Params& p) {
  std::optional<Texture> texture;
  if (p.row().type == "constant") {
    texture = texture_of(t, p, "value", 1);
  } else if (p.row().type == "scale") {
    texture = product(t, p);
  } else if (auto made = p.row().type == "imagemap" ? image(p) : checks(t, p)) {
    texture = Texture{std::nullopt, fmt::format("texture {}", name)};
    set(*made, "id", texture->id, p.at());
    add(t.scene, std::move(*made));
  }
  p.finish();
  if (!t.textures.emplace(name, texture.value_or(Texture{Rgb{1, 1, 1}, {}})).second)
    t.report.error(p.at(), fmt::format("a second Texture \"{}\": names of textures differ in pbrt-v4", name));
}

void add_value(Translation& t, Element& parent, Params& p, Names names, const Rgb& fallback) {
  const Param* given = p.take(names.theirs);
  if (!given) return add(parent, std::string(names.ours), fallback, p.at());
  if (const auto texture = texture_of(t, *given)) give(parent, names.ours, *texture, given->at);
}

void add_scaled_value(Translation& t, Element& parent, Params& p, std::string_view name, const Rgb& fallback,
                      double scale) {
  const Param* given = p.take(name);
  auto texture = given ? texture_of(t, *given) : Texture{fallback, {}};
  if (!texture) return;
  const Span at = given ? given->at : p.at();
  if (texture->value)
    for (double& x : *texture->value) x *= scale;
  if (texture->value || scale == 1) return give(parent, name, *texture, at);
  Element product = made("texture", "product", at);
  set(product, "name", std::string(name), at);
  add(product, "first", scale, at);
  give(product, "second", *texture, at);
  add(parent, std::move(product));
}

}  // namespace ls::scene::pbrt
