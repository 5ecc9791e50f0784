// Textures and bsdfs.
#include <fmt/format.h>

#include "common/scene/known.h"
#include "common/scene/materials.h"
#include "common/scene/plugin_error.h"
#include "common/scene/reader.h"
#include "common/scene/suggest.h"
#include "common/scene/transform.h"

namespace ls::scene {

std::optional<TextureIndex> Reader::read_texture(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "uniform") return read_uniform_texture(e, "value");
  if (type == "srgb") return read_uniform_texture(e, "color");
  if (type == "bitmap" && e.tag == "texture") return read_plain_texture<BitmapTexture>(e);
  if (type == "checkerboard" && e.tag == "texture") return read_plain_texture<CheckerboardTexture>(e);
  unknown_plugin(e, report_);
  return std::nullopt;
}

template <class T>
std::optional<TextureIndex> Reader::read_plain_texture(const Element& e) {
  Params p(*this, e);
  T texture;
  bind(p, texture);
  p.finish();
  scene_.textures.emplace_back(texture);
  return TextureIndex{static_cast<std::uint32_t>(scene_.textures.size() - 1)};
}

std::optional<TextureIndex> Reader::read_uniform_texture(const Element& e, std::string_view parameter) {
  Params p(*this, e);
  Rgb value{1, 1, 1};
  if (const Element* given = p.take(parameter))
    p.convert({.name = parameter, .doc = "", .range = kNonNegative}, *given, value);
  p.finish();
  return add_constant_texture(value);
}

std::optional<BsdfIndex> Reader::read_bsdf(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "diffuse") return read_plain_bsdf<DiffuseBsdf>(e);
  if (type == "null") return read_plain_bsdf<NullBsdf>(e);
  if (type == "dielectric") return read_plain_bsdf<DielectricBsdf>(e);
  if (type == "roughplastic") return read_plain_bsdf<RoughPlasticBsdf>(e);
  if (type == "conductor") return read_metal<ConductorBsdf>(e);
  if (type == "roughconductor") return read_metal<RoughConductorBsdf>(e);
  if (type == "twosided") return read_twosided(e);
  unknown_plugin(e, report_);
  return std::nullopt;
}

template <class T>
std::optional<BsdfIndex> Reader::read_plain_bsdf(const Element& e) {
  Params p(*this, e);
  T b;
  bind(p, b);
  p.finish();
  scene_.bsdfs.emplace_back(b);
  return BsdfIndex{static_cast<std::uint32_t>(scene_.bsdfs.size() - 1)};
}

// As the plain ones, but eta and k also come by the name of a metal, and `alpha` stands for alpha_u and
// alpha_v.
template <class T>
std::optional<BsdfIndex> Reader::read_metal(const Element& e) {
  Params p(*this, e);
  T b;
  read_metal_preset(p, b.eta, b.k);
  const bool has_alpha = std::is_same_v<T, RoughConductorBsdf> && p.has("alpha");
  if (has_alpha && (p.has("alpha_u") || p.has("alpha_v")))
    report_.error(e.at, fmt::format("{} gives both alpha and alpha_u, alpha_v", p.title()));
  bind(p, b);
  if constexpr (std::is_same_v<T, RoughConductorBsdf>) {
    if (const Element* alpha = p.take("alpha")) {
      p.convert({.name = "alpha", .doc = "", .range = kPositive}, *alpha, b.alpha_u);
      b.alpha_v = b.alpha_u;
    }
  }
  p.finish();
  scene_.bsdfs.emplace_back(b);
  return BsdfIndex{static_cast<std::uint32_t>(scene_.bsdfs.size() - 1)};
}

void Reader::read_metal_preset(Params& p, Rgb& eta, Rgb& k) {
  const Element* given = p.take("material");
  if (!given) return;
  if (given->tag != "string")
    return report_.error(given->at, fmt::format("'material' of {} wants a <string>", p.title()));
  const Metal* metal = named_metal(given->get("value"));
  if (!metal) {
    const std::string hint = suggestion(given->get("value"), named_metals());
    return report_.error(
        value_place(*given, "value"),
        fmt::format("there is no metal \"{}\" in the table{}; or give eta and k", given->get("value"), hint));
  }
  if (p.has("eta") || p.has("k"))
    return report_.error(given->at, fmt::format("{} gives both a material and eta or k", p.title()));
  eta = metal->eta;
  k = metal->k;
}

std::optional<BsdfIndex> Reader::read_twosided(const Element& e) {
  Params p(*this, e);
  const auto nested = p.take_nested("bsdf");
  p.finish();
  if (nested.empty() || nested.size() > 2) {
    report_.error(e.at,
                  fmt::format("bsdf \"twosided\" needs one or two nested bsdfs, not {}", nested.size()));
    return std::nullopt;
  }
  std::vector<BsdfIndex> sides;
  for (const auto& [object, use] : nested) {
    const auto index = bsdf(*object, *use);
    if (!index) return std::nullopt;
    const Bsdf& inner = scene_.bsdfs[index->value];
    if (std::holds_alternative<DielectricBsdf>(inner) || std::holds_alternative<NullBsdf>(inner) ||
        std::holds_alternative<TwoSidedBsdf>(inner)) {
      report_.error(use->at,
                    fmt::format("bsdf \"{}\" has two sides of its own: it can't stand in \"twosided\"",
                                object->get("type")));
      return std::nullopt;
    }
    sides.push_back(*index);
  }
  scene_.bsdfs.emplace_back(TwoSidedBsdf{sides.front(), sides.back()});
  return BsdfIndex{static_cast<std::uint32_t>(scene_.bsdfs.size() - 1)};
}

}  // namespace ls::scene
