#include "formats/reader/upgrade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "formats/xml/values.h"

namespace ls::scene {
namespace {

constexpr Renamed kRenamed[] = {
    {"bsdf", "diffuse", "diffuseReflectance", "reflectance"},
    {"bsdf", "difftrans", "diffuseTransmittance", "transmittance"},
    {"medium", "heterogeneous", "density", "sigma_t"},
};

// Values of parameters, with the values that replace them in Mitsuba 3. In old versions `trilinear` and `ewa`
// also filter minified textures; `bilinear` does not, so minified textures need more samples.
constexpr struct {
  std::string_view tag, plugin, parameter, before, now;
} kValues[] = {
    {"texture", "bitmap", "filter_type", "trilinear", "bilinear"},
    {"texture", "bitmap", "filter_type", "ewa", "bilinear"},
};

Attribute* find(Element& e, std::string_view name) {
  const auto it = std::find_if(e.attributes.begin(), e.attributes.end(),
                               [&](const Attribute& a) { return a.name == name; });
  return it == e.attributes.end() ? nullptr : &*it;
}

Element* child(Element& e, std::string_view name) {
  const auto it = std::find_if(e.children.begin(), e.children.end(),
                               [&](const Element& c) { return c.get("name") == name; });
  return it == e.children.end() ? nullptr : &*it;
}

void erase_child(Element& e, std::string_view name) {
  std::erase_if(e.children, [&](const Element& c) { return c.get("name") == name; });
}

// Makes an element that an old file does not have, such as one for an old default. Messages about the element
// refer to `at`, the place of the object that it is added to.
Element made(std::string tag, const Span& at) {
  Element e = made(std::move(tag), "", at);
  e.old = true;
  return e;
}

void add_default(Element& e, std::string tag, std::string name, std::string value) {
  if (child(e, name)) return;
  Element property = made(std::move(tag), e.at);
  set(property, "name", std::move(name), e.at);
  set(property, "value", std::move(value), e.at);
  add(e, std::move(property));
}

void rename_parameters(Element& e) {
  const std::string_view plugin = e.get("type");
  for (const Renamed& row : kRenamed)
    if (row.tag == e.tag && row.plugin == plugin)
      if (Element* c = child(e, snake_case(row.before))) find(*c, "name")->value = row.now;
  for (const auto& row : kValues)
    if (row.tag == e.tag && row.plugin == plugin)
      if (Element* c = child(e, row.parameter))
        if (Attribute* value = find(*c, "value"); value && value->value == row.before) value->value = row.now;
}

// Moves the value of a texture's parameter to one component (`axis`) of a transform step.
void move_part(Element& texture, std::string_view parameter, Element& step, std::string_view axis) {
  Element* c = child(texture, parameter);
  if (!c) return;
  const Attribute* value = c->find("value");
  step.attributes.push_back(
      {std::string(axis), std::string(c->get("value")), c->at, value ? value->value_at : c->at});
  step.at = c->at;
  erase_child(texture, parameter);
}

// Converts uscale, vscale, uoffset and voffset, which mean (u, v) * scale + offset, to a transform.
void place_texture(Element& e) {
  Element scale = made("scale", e.at), translate = made("translate", e.at);
  move_part(e, "uscale", scale, "x");
  move_part(e, "vscale", scale, "y");
  move_part(e, "uoffset", translate, "x");
  move_part(e, "voffset", translate, "y");
  if (scale.attributes.empty() && translate.attributes.empty()) return;
  Element transform = made("transform", e.at);
  set(transform, "name", "to_uv", e.at);
  for (Element* step : {&scale, &translate})
    if (!step->attributes.empty()) transform.children.push_back(std::move(*step));
  e.children.push_back(std::move(transform));
}

// Upgrades a bitmap texture. A gamma of -1 means the gamma of the image's file; a gamma of 1 means linear
// values, which is now `raw`. If the wrap modes for u and v are equal, they become one for both.
void upgrade_bitmap(Element& e) {
  if (const Element* gamma = child(e, "gamma")) {
    const auto value = parse_number(gamma->get("value"));
    if (value == 1) add_default(e, "boolean", "raw", "true");
    if (value == 1 || value == -1) erase_child(e, "gamma");
  }
  Element* u = child(e, "wrap_mode_u");
  const Element* v = child(e, "wrap_mode_v");
  if (u && v && u->get("value") == v->get("value")) {
    find(*u, "name")->value = "wrap_mode";
    erase_child(e, "wrap_mode_v");
  }
}

// Makes colours linear. In old files <rgb> is linear, even if it is written in hexadecimal; <srgb> is encoded
// as sRGB and is decoded here.
void upgrade_colour(Element& e) {
  Attribute* value = find(e, "value");
  const bool encoded = e.tag == "srgb";
  e.tag = "rgb";
  if (!value) return;
  std::optional<Rgb> c;
  if (const auto hex = parse_hex(value->value))
    c = *hex;
  else if (encoded)
    if (const auto numbers = parse_numbers(value->value, 3);
        numbers && (numbers->size() == 1 || numbers->size() == 3))
      c = Rgb{numbers->front(), (*numbers)[numbers->size() / 2], numbers->back()};
  if (!c) return;
  if (encoded)
    for (double& x : *c) x = decode_srgb(x);
  value->value = fmt::format("{} {} {}", (*c)[0], (*c)[1], (*c)[2]);
}

// Normalises the axis of a rotation: in old files it may have any length.
void upgrade_rotation(Element& e) {
  Vec3 axis{0, 0, 0};
  static constexpr std::string_view kAxes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) {
    const Attribute* a = e.find(kAxes[i]);
    const auto x = a ? parse_number(a->value) : std::optional(0.0);
    if (!x) return;
    axis[i] = *x;
  }
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0) || !std::isfinite(length) || length == 1) return;
  for (std::size_t i = 0; i < 3; ++i)
    if (Attribute* a = find(e, kAxes[i])) a->value = fmt::format("{}", axis[i] / length);
}

void upgrade_object(Element& e) {
  rename_parameters(e);
  const std::string_view type = e.get("type");
  if (e.tag == "texture") place_texture(e);
  if (e.tag == "texture" && type == "bitmap") upgrade_bitmap(e);
  if (e.tag == "bsdf" && (type == "conductor" || type == "roughconductor") && !child(e, "eta") &&
      !child(e, "k"))
    add_default(e, "string", "material", "Cu");
  if (e.tag == "bsdf" && (type == "normalmap" || type == "bumpmap")) {
    add_default(e, "boolean", "flip_invalid_normals", "false");
    add_default(e, "boolean", "use_shadowing_function", "false");
  }
  if (e.tag == "volume" && type == "gridvolume") {
    add_default(e, "boolean", "use_grid_bbox", "true");
    add_default(e, "boolean", "node_centred", "true");
  }
}

}  // namespace

bool is_old_version(std::string_view version) {
  return !version.empty() && version[0] < '2' && (version.size() == 1 || version[1] == '.');
}

void upgrade(Element& e) {
  if (e.tag == "default") return;  // the name in a <default> is the scene's own and stays unchanged
  e.old = true;
  if (Attribute* name = find(e, "name")) name->value = snake_case(name->value);
  if (e.tag == "lookAt") e.tag = "lookat";
  if (e.tag == "rotate") upgrade_rotation(e);
  // `intent` only matters to spectral renderers.
  if (e.tag == "rgb" || e.tag == "spectrum")
    std::erase_if(e.attributes, [](const Attribute& a) { return a.name == "intent"; });
  if (e.tag == "rgb" || e.tag == "srgb") return upgrade_colour(e);
  upgrade_object(e);
}

std::string snake_case(std::string_view name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool hump = i > 0 && std::isupper(c) && std::islower(static_cast<unsigned char>(name[i - 1]));
    if (hump) out += '_';
    out += static_cast<char>(hump || (i > 0 && std::isupper(c)) ? std::tolower(c) : c);
  }
  return out;
}

std::span<const Renamed> renamed_parameters() { return kRenamed; }

}  // namespace ls::scene
