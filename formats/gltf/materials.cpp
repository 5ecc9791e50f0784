// Translates materials. The bsdfs are chosen as in our Blender add-on for a Principled BSDF (file
// blender/lightshaft/materials.py), so that a scene looks the same whether it comes as glTF or through the
// add-on.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/gltf/translation.h"

namespace ls::scene::gltf {
namespace {

// A surface whose roughness alpha is below this is treated as perfectly smooth, as in the add-on.
constexpr double kSmooth = 1e-3;
// Lower bound of the components of attenuationColor, since for a transmittance of 0 the extinction would be
// infinite.
constexpr double kLeastPassed = 1e-6;

Element two_sided(Element inner, const Span& at) {
  Element out = made("bsdf", "twosided", at);
  add(out, std::move(inner));
  return out;
}

class MaterialTranslator {
 public:
  MaterialTranslator(Translation& t, const Item& material, const MeshKind& kind)
      : t_(t), m_(material), at_(material.at()), pbr_(material["pbrMetallicRoughness"]), kind_(kind) {
    read();
  }

  Element bsdf(Material& out) {
    if (is_unlit()) return masked(black());
    if (transmission_.is(0) || metallic_.is(1)) return masked(mapped_opaque(metallic_));
    return masked(has_volume() ? mapped(body(out)) : sheet());
  }

  // Returns the emitter of the surface; nullopt: it gives no light.
  std::optional<Element> light() {
    if (is_unlit()) return shining(base_);
    const double strength = m_.extension("KHR_materials_emissive_strength")["emissiveStrength"].number(1);
    auto factor = m_["emissiveFactor"].numbers<3>({0, 0, 0});
    for (double& x : factor) x *= strength;
    return shining(colour_source(t_, factor, m_["emissiveTexture"]));
  }

 private:
  void read() {
    auto factor = pbr_["baseColorFactor"].numbers<4>({1, 1, 1, 1});
    for (double& x : factor) x = share(x);
    base_ = colour_source(t_, {factor[0], factor[1], factor[2]}, pbr_["baseColorTexture"]);
    if (kind_.colours) base_.images.push_back(vertex_attribute("vertex_color", at_));
    read_opacity(factor[3]);
    const Item both = pbr_["metallicRoughnessTexture"];
    metallic_ = number_source(t_, pbr_["metallicFactor"], 1, both, Part::blue);
    roughness_ = number_source(t_, pbr_["roughnessFactor"], 1, both, Part::green);
    const Item transmission = m_.extension("KHR_materials_transmission");
    transmission_ = number_source(t_, transmission["transmissionFactor"], 0,
                                  transmission["transmissionTexture"], Part::red);
    const Item coat = m_.extension("KHR_materials_clearcoat");
    coat_ = number_source(t_, coat["clearcoatFactor"], 0, coat["clearcoatTexture"], Part::red);
    const Item ior = m_.extension("KHR_materials_ior")["ior"];
    ior_ = ior.number(1.5);
    if (ior_ < 1) ior.error("an index of refraction of at least 1 is read");
    read_specular();
  }

  // Computes seen_ior_ from ior_ and KHR_materials_specular. Its reflectance at normal incidence is the one
  // of ior_, multiplied by specularFactor and by the largest component of specularColorFactor, and at most
  // 0.99.
  void read_specular() {
    const Item specular = m_.extension("KHR_materials_specular");
    for (const char* name : {"specularTexture", "specularColorTexture"})
      if (specular[name].given()) t_.warn_once(specular[name], fmt::format("{} has no effect here", name));
    const auto tint = specular["specularColorFactor"].numbers<3>({1, 1, 1});
    const double brightest = std::max({tint[0], tint[1], tint[2]});
    if (tint != std::array<double, 3>{brightest, brightest, brightest})
      t_.warn_once(specular["specularColorFactor"],
                   "reflections are not tinted here: the factor counts as grey");
    const double factor = specular["specularFactor"].number(1) * brightest;
    const double root = (ior_ - 1) / (ior_ + 1), f0 = std::min(root * root * factor, .99);
    seen_ior_ = factor == 1 ? ior_ : std::max((1 + std::sqrt(f0)) / (1 - std::sqrt(f0)), 1.001);
  }

  // True if the transmitting material is the surface of a solid body; false if it is a thin sheet.
  bool has_volume() const { return m_.extension("KHR_materials_volume")["thicknessFactor"].number(0) > 0; }

  // True for a material that reflects nothing and emits its base colour.
  bool is_unlit() const { return m_.extension("KHR_materials_unlit").given(); }

  Element black() {
    Element inner = made("bsdf", "diffuse", at_);
    add(inner, "reflectance", 0., at_);
    return two_sided(std::move(inner), at_);
  }

  // Where the surface is cut out or lets light pass by its opacity, it gives as much less light.
  std::optional<Element> shining(Source radiance) {
    for (std::size_t i = 0; i < 3; ++i) radiance.factor[i] *= opacity_.factor[i];
    if (radiance.factor == std::array<double, 3>{0, 0, 0}) return std::nullopt;
    radiance.images.insert(radiance.images.end(), opacity_.images.begin(), opacity_.images.end());
    t_.has_light = true;
    if (m_["doubleSided"].is_true(false))
      t_.warn_once(m_, "a surface that gives light does so on its front only, though it is doubleSided");
    Element out = made("emitter", "area", at_);
    give(out, "radiance", radiance, at_);
    return out;
  }

  Element mapped_opaque(const Source& metallic) { return two_sided(mapped(opaque(metallic)), at_); }

  Element opaque(const Source& metallic) {
    if (!roughness_.is_constant() || !coat_.is(0)) return burley(metallic, Source{{0, 0, 0}, {}});
    if (metallic.is(1)) return burley(metallic, Source{{0, 0, 0}, {}});
    Element coated = made("bsdf", "roughplastic", at_);
    const double alpha = std::clamp(roughness_.factor[0], 0., 1.);
    add(coated, "string", "distribution", "ggx", at_);
    add(coated, "alpha", std::max(alpha * alpha, kSmooth), at_);
    add(coated, "int_ior", seen_ior_, at_);
    add(coated, "ext_ior", 1., at_);
    give(coated, "diffuse_reflectance", base_, at_);
    add(coated, "boolean", "multiple_scattering", "true", at_);
    if (metallic.is(0)) return coated;
    return blend(metallic, std::move(coated), burley(Source{}, Source{{0, 0, 0}, {}}));
  }

  Element burley(const Source& metallic, const Source& transmission) {
    Element out = made("bsdf", "principled", at_);
    give(out, "base_color", base_, at_);
    give(out, "metallic", metallic, at_);
    give(out, "roughness", roughness_, at_);
    if (!transmission.is(0)) give(out, "spec_trans", transmission, at_);
    add(out, "eta", std::max(seen_ior_, 1.001), at_);
    add(out, "boolean", "multiple_scattering", "true", at_);
    if (!coat_.is(0)) add_coat(out);
    return out;
  }

  // Adds a clear coat to a "principled" bsdf (Burley's model), whose coat has a roughness alpha from 0.1
  // (clearcoat_gloss 0) to 0.001 (clearcoat_gloss 1).
  void add_coat(Element& out) {
    const Item coat = m_.extension("KHR_materials_clearcoat");
    const double roughness = coat["clearcoatRoughnessFactor"].number(0), alpha = roughness * roughness;
    give(out, "clearcoat", coat_, at_);
    add(out, "clearcoat_gloss", std::clamp((.1 - alpha) / (.1 - .001), 0., 1.), at_);
    t_.warn_once(
        coat, "a clear coat is Burley's here: a quarter as bright as glTF's, and at most of roughness 0.32");
    for (const char* name : {"clearcoatRoughnessTexture", "clearcoatNormalTexture"})
      if (coat[name].given()) t_.warn_once(coat[name], fmt::format("{} has no effect here", name));
  }

  // Returns the bsdf of the surface of a solid body of glass, and adds the medium inside the body to the
  // scene.
  Element body(Material& out) {
    out.interior = interior();
    const bool plain =
        transmission_.is(1) && metallic_.is(0) && roughness_.is_constant() && base_.is_constant();
    if (!plain) return burley(metallic_, transmission_);
    const double alpha = roughness_.factor[0] * roughness_.factor[0];
    const bool smooth = alpha < kSmooth;
    Element glass = made("bsdf", smooth ? "dielectric" : "roughdielectric", at_);
    add(glass, "int_ior", ior_, at_);
    add(glass, "ext_ior", 1., at_);
    // Light that passes through a body crosses its surface twice. So each crossing multiplies it by the
    // square root of the base colour, and both together by the base colour.
    Rgb passed{};
    for (std::size_t i = 0; i < 3; ++i) passed[i] = std::sqrt(std::max(base_.factor[i], 0.));
    add(glass, "specular_transmittance", passed, at_);
    if (!smooth) {
      add(glass, "string", "distribution", "ggx", at_);
      add(glass, "alpha", std::min(alpha, 1.), at_);
      add(glass, "boolean", "multiple_scattering", "true", at_);
    }
    return glass;
  }

  // Adds the absorbing medium inside a body. Its transmittance over attenuationDistance is attenuationColor.
  // Returns the id of the medium; empty: it would absorb nothing, so none was added.
  std::string interior() {
    const Item volume = m_.extension("KHR_materials_volume");
    const auto colour = volume["attenuationColor"].numbers<3>({1, 1, 1});
    const Item distance = volume["attenuationDistance"];
    if (!distance.given() || colour == std::array<double, 3>{1, 1, 1}) return {};
    if (!(distance.number(1) > 0)) {
      distance.error("a distance above 0 is wanted here");
      return {};
    }
    Element medium = made("medium", "homogeneous", at_);
    Rgb sigma{};
    for (std::size_t i = 0; i < 3; ++i)
      sigma[i] = -std::log(std::clamp(colour[i], kLeastPassed, 1.)) / distance.number(1);
    std::string id = t_.fresh_id("within " + m_["name"].text("material"));
    set(medium, "id", id, at_);
    add(medium, "sigma_t", sigma, at_);
    add(medium, "albedo", 0., at_);
    t_.add(std::move(medium));
    return id;
  }

  // Returns the bsdf of a transmitting surface without a volume, which is a thin sheet of glass. Its metallic
  // part is opaque.
  Element sheet() {
    if (!coat_.is(0) && transmission_.is(1))
      t_.warn_once(m_.extension("KHR_materials_clearcoat"), "a clear coat has no effect on a sheet of glass");
    Element clear = sheet_of_glass();
    const Source none{{0, 0, 0}, {}};
    if (!transmission_.is(1)) clear = blend(transmission_, mapped_opaque(none), std::move(clear));
    if (metallic_.is(0)) return clear;
    return blend(metallic_, std::move(clear), mapped_opaque(Source{}));
  }

  Element blend(const Source& weight, Element first, Element second) {
    Element out = made("bsdf", "blendbsdf", at_);
    give(out, "weight", weight, at_);
    add(out, std::move(first));
    add(out, std::move(second));
    return out;
  }

  Element sheet_of_glass() {
    const double alpha = roughness_.factor[0] * roughness_.factor[0];
    const bool smooth = roughness_.is_constant() && alpha < kSmooth;
    Element glass = made("bsdf", smooth ? "thindielectric" : "roughthindielectric", at_);
    add(glass, "int_ior", ior_, at_);
    add(glass, "ext_ior", 1., at_);
    give(glass, "specular_transmittance", base_, at_);
    if (smooth) return glass;
    add(glass, "string", "distribution", "ggx", at_);
    if (roughness_.is_constant()) {
      add(glass, "alpha", std::min(alpha, 1.), at_);
      add(glass, "boolean", "multiple_scattering", "true", at_);
    } else {
      give(glass, "alpha", squared(roughness_), at_);
    }
    return mapped(std::move(glass));
  }

  static Source squared(Source s) {
    for (double& x : s.factor) x *= x;
    const std::vector<Element> images = s.images;
    s.images.insert(s.images.end(), images.begin(), images.end());
    return s;
  }

  Element mapped(Element inner) {
    const Item info = m_["normalTexture"];
    auto normals = texture(t_, info, Part::normal);
    if (!normals) return inner;
    if (info["scale"].number(1) != 1)
      t_.warn_once(info["scale"], "the strength of a normal map counts as 1 here");
    Element map = made("bsdf", "normalmap", at_);
    add(map, "boolean", "follow_mirroring", "true", at_);
    set(*normals, "name", "normalmap", at_);
    add(map, std::move(*normals));
    add(map, std::move(inner));
    return map;
  }

  // Reads the surface's opacity: 1 without alphaMode; of alphaMode MASK 0 or 1.
  void read_opacity(double factor) {
    const std::string mode = m_["alphaMode"].text("OPAQUE");
    if (mode == "OPAQUE") return;
    if (mode != "MASK" && mode != "BLEND") return m_["alphaMode"].error("alphaMode is OPAQUE, MASK or BLEND");
    opacity_.factor.fill(factor);
    if (auto image = texture(t_, pbr_["baseColorTexture"], Part::alpha))
      opacity_.images.push_back(std::move(*image));
    if (kind_.opacities) opacity_.images.push_back(vertex_attribute("vertex_opacity", at_));
    if (mode == "BLEND") return;
    const double cutoff = std::max(m_["alphaCutoff"].number(.5), 0.);
    if (opacity_.is_constant()) return opacity_.factor.fill(opacity_.factor[0] >= cutoff ? 1 : 0);
    if (cutoff == 0) return void(opacity_ = Source{});  // no alpha is below it
    Element holder = made("bsdf", "mask", at_);
    give(holder, "opacity", opacity_, at_, cutoff);
    opacity_ = Source{{1, 1, 1}, std::move(holder.children)};
    std::erase_if(opacity_.images[0].attributes, [](const Attribute& a) { return a.name == "name"; });
  }

  Element masked(Element inner) {
    if (opacity_.is(1)) return inner;
    Element mask = made("bsdf", "mask", at_);
    give(mask, "opacity", opacity_, at_);
    add(mask, std::move(inner));
    return mask;
  }

  Translation& t_;
  const Item m_;
  const Span at_;
  const Item pbr_;
  const MeshKind kind_;
  Source base_, opacity_, metallic_, roughness_, transmission_, coat_;
  double ior_ = 1.5, seen_ior_ = 1.5;
};

// Returns all textures of the material that affect its translation. Item::given() is false for a texture that
// the material lacks.
std::vector<Item> textures_of(const Item& m) {
  const Item pbr = m["pbrMetallicRoughness"];
  return {pbr["baseColorTexture"],
          pbr["metallicRoughnessTexture"],
          m["normalTexture"],
          m["emissiveTexture"],
          m.extension("KHR_materials_transmission")["transmissionTexture"],
          m.extension("KHR_materials_clearcoat")["clearcoatTexture"]};
}

}  // namespace

std::size_t Materials::uv_set(const Item& index) {
  const Item material = index.in(t_.root["materials"]);
  std::optional<std::size_t> set;
  for (const Item& info : textures_of(material)) {
    if (!info.given()) continue;
    const std::size_t own = gltf::uv_set(info);
    if (set && own != *set)
      t_.warn_once(info, fmt::format("this texture asks for TEXCOORD_{}, but a mesh has one set here, and "
                                     "others of this material ask for TEXCOORD_{}",
                                     own, *set));
    set = set.value_or(own);
  }
  return set.value_or(0);
}

bool Materials::uses_opacity(const Item& index) const {
  return index.in(t_.root["materials"])["alphaMode"].text("OPAQUE") != "OPAQUE";
}

const Material& Materials::of(const Item& index, const MeshKind& kind) {
  const Item material = index.in(t_.root["materials"]);
  const auto [known, is_new] = known_.try_emplace({material.identity(), kind});
  Material& out = known->second;
  if (!is_new) return out;
  out.id = t_.fresh_id(material["name"].text("material"));
  MaterialTranslator translator(t_, material, kind);
  Element bsdf = translator.bsdf(out);
  out.light = translator.light();
  set(bsdf, "id", out.id, material.at());
  t_.add(std::move(bsdf));
  return out;
}

}  // namespace ls::scene::gltf
