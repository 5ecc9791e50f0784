// Translates materials.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/text/suggest.h"
#include "formats/pbrt/object_translation.h"

namespace ls::scene::pbrt {
namespace {

// pbrt treats a surface as smooth if its roughness alpha is below this value along both u and v.
constexpr double kSmooth = 1e-3;

struct Glass {
  std::string_view name;
  double eta;
};
// Indices of refraction at 587.6 nm, from the manufacturer's data sheets. pbrt's F5, F10 and F11 are Schott's
// SF5, SF10 and SF11.
constexpr Glass kGlasses[] = {{"glass-BK7", 1.5168},   {"glass-BAF10", 1.6700}, {"glass-FK51A", 1.4866},
                              {"glass-LASF9", 1.8503}, {"glass-F5", 1.6727},    {"glass-F10", 1.7283},
                              {"glass-F11", 1.7847}};
constexpr std::string_view kMetals[] = {"Ag", "Al", "Au", "Cu"};

class MaterialTranslator {
 public:
  MaterialTranslator(Translation& t, Params& p) : t_(t), p_(p) {}

  std::optional<Element> run(Material& m) {
    const std::string_view type = p_.row().type;
    if (type == "diffuse" || type == "matte") return both_sides(diffuse());
    if (type == "coateddiffuse") return both_sides(coated());
    if (type == "conductor") return both_sides(conductor());
    if (type == "coatedconductor") return both_sides(coated_conductor());
    if (type == "mirror") return both_sides(mirror());
    if (type == "mix") return mix(m);
    m.transmits = true;
    if (type == "dielectric") return shaped(dielectric());
    if (type == "diffusetransmission") return shaped(diffuse_transmission());
    if (type == "thindielectric") return shaped(with_eta(made("bsdf", "thindielectric", p_.at())));
    m.null = true;
    return made("bsdf", "null", p_.at());
  }

 private:
  Element diffuse() {
    Element out = made("bsdf", "diffuse", p_.at());
    const bool old = p_.row().type == "matte";
    add_value(t_, out, p_, {old ? "Kd" : "reflectance", "reflectance"}, {.5, .5, .5});
    if (old && p_.number("sigma", 0) != 0)
      t_.report.warning(p_.at(), "'sigma' of Material \"matte\" is read as 0: an ideally rough surface");
    return out;
  }

  Element diffuse_transmission() {
    Element out = made("bsdf", "diffusetransmission", p_.at());
    const double scale = p_.number("scale", 1);
    for (const std::string_view name : {"reflectance", "transmittance"})
      add_scaled_value(t_, out, p_, name, {.25, .25, .25}, scale);
    return out;
  }

  Element coated() {
    const auto alpha = roughness(Images::none);
    Element out = with_eta(made("bsdf", alpha.is_smooth() ? "plastic" : "roughplastic", p_.at()));
    add_value(t_, out, p_, {"reflectance", "diffuse_reflectance"}, {.5, .5, .5});
    add(out, "boolean", "nonlinear", "true", p_.at());
    if (!alpha.is_smooth()) {
      add(out, "string", "distribution", "ggx", p_.at());
      add(out, "alpha", coat_alpha(alpha, ": only one is known of a coat"), p_.at());
    }
    t_.warn_once(p_.at(),
                 "\"coateddiffuse\" is read as \"plastic\" or \"roughplastic\": light within a rough coat is "
                 "averaged over directions there");
    return out;
  }

  Element conductor() {
    const auto alpha = roughness(Images::allowed);
    Element out = made("bsdf", alpha.is_smooth() ? "conductor" : "roughconductor", p_.at());
    if (!alpha.is_smooth()) add_alpha(out, alpha);
    if (p_.has("reflectance"))
      by_reflectance(out);
    else
      by_indices(out, "eta", "k");
    return out;
  }

  Element coated_conductor() {
    const auto coat = roughness(Images::none, "interface."), metal = roughness(Images::none, "conductor.");
    Element out = with_eta(made("bsdf", "coatedconductor", p_.at()), "interface.eta");
    const double alpha =
        coat_alpha(coat, " of the interface: only one is known of a coat. Give interface.roughness");
    add(out, "coat_alpha", coat.is_smooth() ? 0. : alpha, p_.at());
    add(out, "alpha_u", metal.is_smooth() ? 0. : metal.u.number, p_.at());
    add(out, "alpha_v", metal.is_smooth() ? 0. : metal.v.number, p_.at());
    // pbrt divides eta and k by the coat's index of refraction, even if it computes them from a reflectance.
    // Our `coatedconductor` also divides them, so it gets the undivided values here.
    if (p_.has("reflectance"))
      by_reflectance(out);
    else
      by_indices(out, "conductor.eta", "conductor.k");
    if (!coat.is_smooth() || !metal.is_smooth())
      t_.warn_once(
          p_.at(),
          "a rough \"coatedconductor\" is approximated: pbrt follows light at random between coat and metal, "
          "here a formula describes it (docs/design/coated-metal.md says how far they differ)");
    return out;
  }

  // Adds the eta and k of a metal with the reflectance r, by pbrt's formulas: eta = 1, k = 2 sqrt(r / (1 -
  // r)), with r at most 0.9999.
  void by_reflectance(Element& out) {
    const auto r = surface_colour(t_, *p_.take("reflectance"));
    if (!r) return;
    Rgb k{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = std::clamp((*r)[i], 0., .9999);
      k[i] = 2 * std::sqrt(x) / std::sqrt(1 - x);
    }
    add(out, "eta", Rgb{1, 1, 1}, p_.at());
    add(out, "k", k, p_.at());
  }

  void by_indices(Element& out, std::string_view eta_name, std::string_view k_name) {
    const Param *eta = p_.take(eta_name), *k = p_.take(k_name);
    const auto metal_of = [](const Param* p, std::string_view which) {
      if (!p) return std::string("Cu");
      if (p->texts.size() != 1 || !p->texts[0].starts_with("metal-")) return std::string();
      std::string name = p->texts[0].substr(6);
      return name.ends_with(which) ? name.substr(0, name.size() - which.size()) : std::string();
    };
    const std::string metal = metal_of(eta, "-eta"), same = metal_of(k, "-k");
    if (metal.empty() && same.empty()) {
      for (const auto& [p, name] : {std::pair{eta, "eta"}, {k, "k"}})
        if (const auto c = surface_colour(t_, *p, RgbOf::matter)) add(out, name, *c, p->at);
      return;
    }
    if (metal != same)
      return p_.error(
          p_.at(),
          fmt::format("{} and {} of {} are not of one metal: give both of the same, or both as numbers",
                      eta_name, k_name, p_.title()));
    if (std::find(std::begin(kMetals), std::end(kMetals), metal) == std::end(kMetals))
      return p_.error(
          eta->at,
          fmt::format("there is no metal \"{}\" in the table (Ag, Al, Au, Cu): give {} and {} as rgb", metal,
                      eta_name, k_name));
    add(out, "string", "material", metal, p_.at());
  }

  Element mirror() {
    Element out = made("bsdf", "conductor", p_.at());
    add_value(t_, out, p_, {"Kr", "specular_reflectance"}, {.9, .9, .9});
    return out;
  }

  Element dielectric() {
    const auto alpha = roughness(Images::allowed);
    Element out = with_eta(made("bsdf", alpha.is_smooth() ? "dielectric" : "roughdielectric", p_.at()));
    if (!alpha.is_smooth()) add_alpha(out, alpha);
    return out;
  }

  std::optional<Element> mix(Material& m) {
    const Param* names = p_.take("materials");
    Element out = made("bsdf", "blendbsdf", p_.at());
    add_value(t_, out, p_, {"amount", "weight"}, {.5, .5, .5});
    if (!names || names->texts.size() != 2)
      return p_.refuse(p_.at(), fmt::format("{} needs 'materials', the names of two", p_.title()));
    for (const std::string& name : names->texts) {
      const auto found = t_.materials.find(name);
      if (found == t_.materials.end())
        return p_.refuse(names->at, fmt::format("no MakeNamedMaterial \"{}\" stands before this", name));
      m.transmits |= found->second.transmits;
      m.has_texture |= found->second.has_texture;
      m.has_normal_map |= found->second.has_normal_map;
      refer(out, "", found->second.id, names->at);
    }
    return out;
  }

  // A roughness alpha: a number, or the texture that holds it in an image.
  struct Alpha {
    double number = 0;
    std::string image{};
    bool operator==(const Alpha&) const = default;
    bool is_smooth() const { return image.empty() && number < kSmooth; }
  };
  struct Roughness {
    Alpha u, v;
    bool is_smooth() const { return u.is_smooth() && v.is_smooth(); }
  };
  enum class Images { none, allowed };

  // Returns the roughness alpha along u and v. `layer` is a prefix of the parameters' names, such as
  // "interface.".
  Roughness roughness(Images images, std::string_view layer = "") {
    const bool remap = p_.boolean("remaproughness", true);
    const auto one = [&](std::string_view what, const Alpha& fallback) {
      const Param* p = p_.take(fmt::format("{}{}", layer, what));
      if (!p) return fallback;
      const bool named = p->type == "texture";
      const Texture* texture =
          named ? find_texture(t_, TextureOf::numbers, p->texts.empty() ? "" : p->texts[0]) : nullptr;
      if (texture && !texture->value)
        return takes_image(*p, images, remap) ? Alpha{0, texture->id} : fallback;
      const bool given = named ? texture != nullptr : p->numbers.size() == 1;
      const double x = !given ? -1 : texture ? (*texture->value)[0] : p->numbers[0];
      if (x >= 0) return Alpha{remap ? std::sqrt(x) : x};
      p_.error(p->at, named && !given ? fmt::format("'{}' names no Texture that stands before this", p->name)
                                      : fmt::format("'{}' of {} wants one number that is not negative",
                                                    p->name, p_.title()));
      return fallback;
    };
    const Alpha both = one("roughness", {});
    return {one("uroughness", both), one("vroughness", both)};
  }

  // False: the roughness can't be an image, which is reported.
  bool takes_image(const Param& p, Images images, bool remap) {
    if (images == Images::allowed && !remap) return true;
    p_.error(p.at, fmt::format("'{}' of {} is an image: {}", p.name, p_.title(),
                               images == Images::none
                                   ? "a layer has one roughness here, a number"
                                   : "pbrt takes the square root of it, so make it an image of that, and "
                                     "give \"bool remaproughness\" false"));
    return false;
  }

  // The bsdf allows no alpha of 0, which one of u and v may have.
  void add_alpha(Element& out, const Roughness& a) {
    add(out, "string", "distribution", "ggx", p_.at());
    for (const auto& [name, alpha] : {std::pair{"alpha_u", a.u}, {"alpha_v", a.v}}) {
      if (alpha.image.empty())
        add(out, name, std::max(alpha.number, 1e-4), p_.at());
      else
        refer(out, name, alpha.image, p_.at());
    }
  }

  // Returns the alpha of a coat, which has one.
  double coat_alpha(const Roughness& a, std::string_view which = {}) {
    if (a.u != a.v) p_.error(p_.at(), fmt::format("{} has two roughnesses{}", p_.title(), which));
    return a.u.number;
  }

  Element with_eta(Element out, std::string_view name = "eta") {
    double eta = 1.5;
    if (const Param* p = p_.take(name)) {
      if (p->type != "spectrum" && p->numbers.size() == 1) {
        eta = p->numbers[0];
      } else if (p->texts.size() == 1) {
        eta = glass(*p);
      } else {
        p_.error(p->at, fmt::format("'{}' of {} wants one number or the name of a glass", name, p_.title()));
      }
    }
    add(out, "int_ior", eta, p_.at());
    add(out, "ext_ior", 1., p_.at());
    return out;
  }

  double glass(const Param& p) {
    std::vector<std::string> known;
    for (const Glass& g : kGlasses) {
      known.emplace_back(g.name);
      if (g.name != p.texts[0]) continue;
      t_.warn_once(p.at, fmt::format("\"{}\" is read as {}: colours are all bent alike", g.name, g.eta));
      return g.eta;
    }
    p_.error(p.at, fmt::format("there is no glass \"{}\" in the table{}", p.texts[0],
                               suggestion(p.texts[0], known)));
    return 1.5;
  }

  // Wraps a bsdf in the bump map and in the normal map of the material, if it has them.
  Element shaped(Element inner) {
    const auto words = {std::pair{"displacement", "bumpmap"}, {"bumpmap", "bumpmap"}};
    for (const auto& [theirs, ours] : words) {
      if (!p_.row().find(theirs) || !p_.has(theirs)) continue;
      Element out = made("bsdf", ours, p_.at());
      add_value(t_, out, p_, {theirs, "texture"}, {0, 0, 0});
      add(out, std::move(inner));
      inner = std::move(out);
    }
    if (!p_.row().find("normalmap") || !p_.has("normalmap")) return inner;
    Element out = made("bsdf", "normalmap", p_.at());
    Element image = made("texture", "bitmap", p_.at());
    set(image, "name", "normalmap", p_.at());
    add(image, "string", "filename", p_.text("normalmap", ""), p_.at());
    add(image, "boolean", "raw", "true", p_.at());
    const Transform upright{{1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1}};
    add_transform(image, nullptr, "to_uv", {matrix_step(upright.m, p_.at())});
    add(out, std::move(image));
    add(out, std::move(inner));
    return out;
  }

  Element both_sides(Element inner) {
    Element out = made("bsdf", "twosided", p_.at());
    add(out, shaped(std::move(inner)));
    return out;
  }

  Translation& t_;
  Params& p_;
};

bool has_normal_map(const Element& e) {
  if (e.tag == "bsdf" && e.get("type") == "normalmap") return true;
  return std::any_of(e.children.begin(), e.children.end(), has_normal_map);
}

// True if the element, or an element below it, is a texture or a named reference to one.
bool has_texture(const Element& e) {
  if (e.tag == "texture" || (e.tag == "ref" && e.find("name"))) return true;
  return std::any_of(e.children.begin(), e.children.end(), has_texture);
}

}  // namespace

std::optional<Material> add_material(Translation& t, const std::string& id, Params& p) {
  Material m{id};
  auto bsdf = MaterialTranslator(t, p).run(m);
  p.finish();
  if (!bsdf) return std::nullopt;
  m.has_texture |= has_texture(*bsdf);
  m.has_normal_map |= has_normal_map(*bsdf);
  set(*bsdf, "id", id, p.at());
  add(t.scene, std::move(*bsdf));
  return m;
}

}  // namespace ls::scene::pbrt
