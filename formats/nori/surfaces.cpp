// Translates Nori's bsdfs and textures.
#include <fmt/format.h>

#include <algorithm>

#include "formats/nori/object.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene::nori {
namespace {

// Maps (u, v) of a Mitsuba mesh to coordinates of an image: x = au u + cu, y = av v + cv.
struct Placement {
  double au = 1, cu = 0, av = 1, cv = 0;
};

void add_placement(Element& texture, const Placement& p) {
  if (p.au == 1 && p.cu == 0 && p.av == 1 && p.cv == 0) return;
  add_transform(texture, nullptr, "to_uv",
                {matrix_step({p.au, 0, 0, p.cu, 0, p.av, 0, p.cv, 0, 0, 1, 0, 0, 0, 0, 1}, texture.at)});
}

// Returns a parameter of one or two numbers for u and v; a single number applies to both.
std::array<double, 2> pair(Object& o, std::string_view parameter, double fallback) {
  const Element* e = o.take(parameter);
  const auto v = e ? parse_numbers(e->get("value"), 3) : std::nullopt;
  if (!v) return {fallback, fallback};
  return {v->front(), v->size() > 1 ? (*v)[1] : v->front()};
}

// Returns the difference of u between Nori and Mitsuba: half a turn on a sphere, otherwise none. (v differs
// on meshes: it starts at the bottom in Nori and at the top in Mitsuba.)
double half_turn(const Mesh& mesh) { return mesh.sphere ? .5 : 0; }

Element checkerboard(Object& o, const Mesh& mesh) {
  Element out = made("texture", "checkerboard", o.element().at);
  add(out, "color0", o.color("value1", {0, 0, 0}), o.element().at);
  add(out, "color1", o.color("value2", {1, 1, 1}), o.element().at);
  const auto scale = pair(o, "scale", 1), delta = pair(o, "delta", 0);
  // Along u and v Mitsuba's checkerboard has two squares per unit; Nori's squares are `scale` units wide.
  add_placement(out, {1 / (2 * scale[0]), (half_turn(mesh) / scale[0] - delta[0]) / 2, -1 / (2 * scale[1]),
                      (1 / scale[1] - delta[1]) / 2});
  return out;
}

Element image(Object& o, const Mesh& mesh, Report& report) {
  Element out = made("texture", "bitmap", o.element().at);
  o.both("filename", "fileName");
  const bool kombu = o.has("fileName");
  if (!kombu && !o.has("filename")) o.missing("filename");
  add_as(out, o.take(kombu ? "fileName" : "filename"), "filename");
  if (const Element* srgb = o.take("srgb"))
    add(out, "boolean", "raw", parse_boolean(srgb->get("value")) == true ? "false" : "true", srgb->at);
  const Element* wrap = o.take("wrap");
  add_as(out, wrap, "wrap_mode");
  add_as(out, o.take("filter"), "filter_type");
  if (wrap && wrap->get("value") != "repeat" && mesh.sphere)
    report.error(value_place(*wrap, "value"),
                 fmt::format("on a sphere {} goes all around: 'wrap' can only be repeat", o.title()));
  Placement p{1, half_turn(mesh), 1, 0};
  if (kombu) {
    const auto scale = pair(o, "scale", 1);
    p = {-1 / scale[0], (1 - half_turn(mesh)) / scale[0], -1 / scale[1], 1 / scale[1]};
  } else if (o.has("scale") && pair(o, "scale", 1) != std::array<double, 2>{1, 1}) {
    report.error(o.element().at, fmt::format("'scale' of {} only has a meaning with fileName", o.title()));
  }
  add_placement(out, p);
  return out;
}

Element bsdf_of(std::string_view type, const Element& e) { return made("bsdf", type, e.at); }

void add_texture(Element& out, Object& o, std::string_view parameter, std::string name, double fallback,
                 const Mesh& mesh, Report& report) {
  const bool given = o.has(parameter);
  if (!given) return add(out, std::move(name), Rgb{fallback, fallback, fallback}, o.element().at);
  const Element* e = o.take(parameter);
  if (auto t = e ? texture(*e, std::move(name), mesh, report) : std::nullopt) add(out, std::move(*t));
}

Element dielectric(Object& o) {
  const double inside = o.number("intIOR", 1.5046), outside = o.number("extIOR", 1.000277);
  if (inside == outside) return bsdf_of("null", o.element());
  Element out = bsdf_of("dielectric", o.element());
  add(out, "int_ior", inside, o.element().at);
  add(out, "ext_ior", outside, o.element().at);
  return out;
}

// Nori's microfacet bsdf is kd / pi + (1 - m) D F G / (4 cos_i cos_o), where the colour kd is its diffuse
// reflectance, m is the largest channel of kd, and D, F and G are the usual microfacet distribution, Fresnel
// term and shadowing. It is translated to a blend: (1 - m) times a rough reflection, and m times a diffuse
// surface with the reflectance kd / m. F is that of a dielectric seen from outside, which equals the Fresnel
// term of a conductor with a real index.
std::optional<Element> microfacet(Object& o, const Mesh& mesh, Report& report) {
  const Span at = o.element().at;
  Element gloss = bsdf_of("roughconductor", o.element());
  add(gloss, "alpha", o.number("alpha", .1), at);
  add(gloss, "eta", o.number("intIOR", 1.5046) / o.number("extIOR", 1.000277), at);
  add(gloss, "k", 0.0, at);
  const bool given = o.has("kd");
  const Element* kd = o.take("kd");
  if (given && !kd) return std::nullopt;
  Element base = made("rgb", "", at);
  set(base, "name", "kd", at);
  set(base, "value", "0.5 0.5 0.5", at);
  if (kd) {
    auto read = texture(*kd, "texture", mesh, report);
    if (!read) return std::nullopt;
    base = std::move(*read);
  }
  Element diffuse = bsdf_of("diffuse", o.element()), blend = bsdf_of("blendbsdf", o.element());
  if (base.tag == "texture") {
    Element weight = made("texture", "peak", at), hue = made("texture", "peak", at);
    set(weight, "name", "weight", at);
    set(hue, "name", "reflectance", at);
    add(weight, base);
    add(hue, std::move(base));
    add(hue, "boolean", "hue", "true", at);
    add(blend, std::move(weight));
    add(diffuse, std::move(hue));
  } else {
    const Rgb color = rgb_of(*parse_numbers(base.get("value"), 3));
    const double peak = *std::max_element(color.begin(), color.end());
    if (peak == 0) return gloss;
    if (!(peak <= 1))
      return report.refuse(kd ? value_place(*kd, "value") : at,
                           fmt::format("'kd' of {} is {}, out of its range 0 <= kd <= 1", o.title(), peak));
    add(blend, "weight", peak, at);
    add(diffuse, "reflectance", Rgb{color[0] / peak, color[1] / peak, color[2] / peak}, at);
  }
  add(blend, std::move(gloss));
  add(blend, std::move(diffuse));
  return blend;
}

Element metal(Object& o, const Mesh& mesh, Report& report) {
  Element out = bsdf_of(o.type(), o.element());
  if (const Element* material = o.take("material")) {
    for (const char* parameter : {"eta", "k"})
      if (o.has(parameter))
        report.error(o.element().at, fmt::format("{} gives both material and {}", o.title(), parameter));
    add_as(out, material, "material");
  } else {
    for (const char* parameter : {"eta", "k"}) {
      if (!o.has(parameter)) o.missing(parameter);
      add_as(out, o.take(parameter), parameter);
    }
  }
  if (o.has("specular_reflectance"))
    add_texture(out, o, "specular_reflectance", "specular_reflectance", 1, mesh, report);
  if (o.type() != "roughconductor") return out;
  add(out, "alpha", o.number("alpha", .1), o.element().at);
  add_as(out, o.take("distribution"), "distribution");
  return out;
}

Element principled(Object& o, const Mesh& mesh, Report& report) {
  Element out = bsdf_of("principled", o.element());
  for (const char* name : {"base_color", "roughness"})
    if (o.has(name)) add_texture(out, o, name, name, .5, mesh, report);
  const bool glass = o.has("spec_trans");
  for (const char* name : {"anisotropic", "clearcoat", "clearcoat_gloss", "flatness", "metallic", "sheen",
                           "sheen_tint", "spec_tint", "spec_trans"})
    add_as(out, o.take(name), name);
  const double specular = o.number("specular", .5);
  // If glass has no specular reflection, 0.001 is used instead of 0, as in Kombu (a descendant of Nori).
  add(out, "specular", glass && specular == 0 ? 1e-3 : specular, o.element().at);
  return out;
}

// Translates the blend of Kombu, a descendant of Nori. The two bsdfs in it have names; its weight may be a
// texture without a name.
std::optional<Element> blend(Object& o, const Mesh& mesh, Report& report) {
  Element out = bsdf_of("blendbsdf", o.element());
  const Element* fresnel = o.take("fresnel");
  if (fresnel && parse_boolean(fresnel->get("value")) == true)
    report.error(
        fresnel->at,
        "a blendbsdf whose weight follows the angle (fresnel) is not supported: choose principled with a "
        "clearcoat, or a microfacet");
  const Element* image = o.has("weight") ? nullptr : o.only("texture");
  if (image) {
    auto t = texture(*image, "weight", mesh, report);
    if (!t) return std::nullopt;
    add(out, std::move(*t));
  } else {
    add_texture(out, o, "weight", "weight", .5, mesh, report);
  }
  for (const char* name : {"bsdf1", "bsdf2"}) {
    const bool given = o.has(name);
    const Element* part = o.take(name);
    if (!given) {
      add(out, bsdf_of("diffuse", o.element()));  // diffuse with Mitsuba's default reflectance, 0.5
      continue;
    }
    auto inner = part ? bsdf(*part, mesh, report) : std::nullopt;
    if (!inner) return std::nullopt;
    add(out, std::move(*inner));
  }
  return out;
}

std::optional<Element> bsdf_in_words(Object& o, const Mesh& mesh, Report& report) {
  const std::string_view type = o.type();
  const Element& e = o.element();
  if (type == "diffuse" || type == "diffuse_tex") {
    Element out = bsdf_of("diffuse", e);
    add_texture(out, o, "albedo", "reflectance", .5, mesh, report);
    return out;
  }
  if (type == "mirror") return bsdf_of("conductor", e);
  if (type == "dielectric") return dielectric(o);
  if (type == "microfacet" || type == "microfacet_tex") return microfacet(o, mesh, report);
  if (type == "blendbsdf") return blend(o, mesh, report);
  if (type == "conductor" || type == "roughconductor") return metal(o, mesh, report);
  if (type == "principled") return principled(o, mesh, report);
  return bsdf_of("null", e);  // for the types "transparent" and "null"
}

}  // namespace

std::optional<Element> texture(const Element& given, std::string name, const Mesh& mesh, Report& report) {
  if (given.tag == "texture") {
    Element out;
    const Plugin* plugin = known_plugin(given, report);
    if (!plugin) return std::nullopt;
    Object o(given, *plugin, report);
    if (plugin->type == "constant_color") {
      Element holder;
      add(holder, name, o.color("value", {0, 0, 0}), given.at);
      out = std::move(holder.children.front());
    } else {
      out = plugin->type == "checkerboard_color" ? checkerboard(o, mesh) : image(o, mesh, report);
      set(out, "name", std::move(name), given.at);
    }
    o.finish();
    return out;
  }
  Element holder;
  add_as(holder, &given, std::move(name));
  return std::move(holder.children.front());
}

std::optional<Element> bsdf(const Element& e, const Mesh& mesh, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  auto out = bsdf_in_words(o, mesh, report);
  o.finish();
  return out;
}

}  // namespace ls::scene::nori
