// Reads textures and bsdfs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "core/scene/schema/materials.h"
#include "core/scene/schema/mesh_attributes.h"
#include "core/scene/schema/traits.h"
#include "formats/reader/reader.h"
#include "formats/reader/unsupported.h"
#include "formats/xml/transform_element.h"

namespace ls::scene {

std::optional<TextureIndex> Reader::read_texture(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "uniform") return read_uniform_texture(e, "value");
  if (type == "srgb") return read_uniform_texture(e, "color");
  if (type == "rawconstant") return read_raw_constant(e);
  if (type == "bitmap" && e.tag == "texture") return read_plain_texture<BitmapTexture>(e);
  if (type == "checkerboard" && e.tag == "texture") return read_plain_texture<CheckerboardTexture>(e);
  if (type == "peak" && e.tag == "texture") return read_plain_texture<PeakTexture>(e);
  if (type == "product" && e.tag == "texture") return read_plain_texture<ProductTexture>(e);
  if (type == "mesh_attribute" && e.tag == "texture") return read_mesh_attribute(e);
  unknown_plugin(e, report_);
  return std::nullopt;
}

template <class T>
std::optional<TextureIndex> Reader::read_plain_texture(const Element& e) {
  Params p(*this, e);
  T texture;
  bind(p, texture);
  p.finish();
  return added<TextureIndex>(texture);
}

std::optional<TextureIndex> Reader::read_mesh_attribute(const Element& e) {
  const auto index = read_plain_texture<MeshAttributeTexture>(e);
  reads_attributes_ = true;
  const std::string& name = std::get<MeshAttributeTexture>(scene_.textures[index->value]).name;
  if (!name.empty() && !is_attribute_name(name))
    report_.error(
        e.at,
        fmt::format("a mesh has no attribute \"{}\": their names begin with \"vertex_\" or \"face_\"", name));
  return index;
}

// Rejects textures that read mesh attributes, for parameters of objects that have no mesh.
void Reader::refuse_attributes(const Element& e, TextureIndex t, std::string_view parameter) {
  if (!reads_attributes_) return;
  for (const AttributeUse& use : attribute_uses(scene_, t))
    report_.error(
        e.at,
        fmt::format("'{}' of {} \"{}\" can't be the mesh attribute \"{}\": there is no mesh here that has it",
                    parameter, e.tag, e.get("type"),
                    std::get<MeshAttributeTexture>(scene_.textures[use.texture.value]).name));
}

std::optional<TextureIndex> Reader::read_uniform_texture(const Element& e, std::string_view parameter) {
  Params p(*this, e);
  Rgb value{1, 1, 1};
  p.read({.name = parameter, .doc = "", .range = kNonNegative}, value);
  p.finish();
  return add_constant_texture(value);
}

// Reads a texture "rawconstant". Its value is one number, or a <vector> or <point> of three numbers.
std::optional<TextureIndex> Reader::read_raw_constant(const Element& e) {
  Params p(*this, e);
  Rgb value{};
  const Field field{.name = "value", .doc = "", .range = kNonNegative};
  const Element* given = p.take("value");
  if (!given) {
    report_.error(e.at, fmt::format("{} needs 'value'", p.title()));
  } else if (given->tag == "vector" || given->tag == "point") {
    Vec3 parts{};
    p.convert(field, *given, parts);
    value = parts;
  } else {
    p.convert(field, *given, value);
  }
  p.finish();
  return add_constant_texture(value);
}

std::optional<BsdfIndex> Reader::add_bsdf(const Element& e, const Bsdf& bsdf) {
  const auto index = added<BsdfIndex>(bsdf);
  if (traits(index).depth <= kMaxBsdfNesting) return index;
  return report_.refuse(e.at, fmt::format("bsdfs are nested more than {} deep", kMaxBsdfNesting));
}

const BsdfTraits& Reader::traits(BsdfIndex bsdf) {
  // A bsdf's inner bsdfs precede it in the list, so their traits are known.
  for (std::size_t i = bsdf_traits_.size(); i < scene_.bsdfs.size(); ++i)
    bsdf_traits_.push_back(traits_of(scene_.bsdfs[i], bsdf_traits_, scene_.textures));
  return bsdf_traits_[bsdf.value];
}

// Checks that the roughness is constant: the energy table of multiple scattering is for a single roughness.
void Reader::check_multiple_scattering(const Element& e, TextureIndex alpha_u, TextureIndex alpha_v) {
  const std::size_t n = scene_.textures.size();
  if (alpha_u.value >= n || alpha_v.value >= n) return;  // the error was reported before
  const auto* u = std::get_if<ConstantTexture>(&scene_.textures[alpha_u.value]);
  const auto* v = std::get_if<ConstantTexture>(&scene_.textures[alpha_v.value]);
  if (!u || !v)
    report_.error(e.at, fmt::format("multiple_scattering of bsdf \"{}\" needs a roughness that is a number, "
                                    "not a texture: give alpha a number, or leave multiple_scattering out",
                                    e.get("type")));
  else if (u->value != v->value)
    report_.error(e.at,
                  fmt::format("multiple_scattering of bsdf \"{}\" needs the same roughness both ways: give "
                              "alpha instead of alpha_u and alpha_v, or leave multiple_scattering out",
                              e.get("type")));
}

// Reads all fields that describe() lists for T. The parameter `alpha` sets both alpha_u and alpha_v.
template <class T>
void Reader::bind_alphas(Params& p, T& b, const Range& range) {
  if (p.has("alpha") && (p.has("alpha_u") || p.has("alpha_v")))
    report_.error(p.object().at, fmt::format("{} gives both alpha and alpha_u, alpha_v", p.title()));
  bind(p, b);
  if (const Element* alpha = p.take("alpha")) {
    p.convert({.name = "alpha", .doc = "", .range = range}, *alpha, b.alpha_u);
    b.alpha_v = b.alpha_u;
  }
}

// Checks that a bsdf with a constant reflectance and transmittance scatters no more light than it receives.
void Reader::check_sum(const Element& e, const DiffuseTransmissionBsdf& b) {
  // A reflectance and a transmittance that are rounded to six digits add up to at most 1.000001, and to
  // slightly more in binary.
  constexpr double kMost = 1 + 1.5e-6;
  const auto constant = [&](TextureIndex t) {
    return t.value < scene_.textures.size() ? std::get_if<ConstantTexture>(&scene_.textures[t.value])
                                            : nullptr;  // no such texture: an error was reported
  };
  const auto *back = constant(b.reflectance), *through = constant(b.transmittance);
  if (!back || !through) return;
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) most = std::max(most, back->value[i] + through->value[i]);
  if (most > kMost)
    report_.error(e.at, fmt::format("reflectance and transmittance of bsdf \"{}\" sum up to {:.9g}: a "
                                    "surface sends on at most 1, all of its light, so lower one of them",
                                    e.get("type"), most));
}

// Reads the bsdf `difftrans` of Mitsuba 0.6 as a diffuse transmission that reflects nothing.
std::optional<BsdfIndex> Reader::read_difftrans(const Element& e) {
  Params p(*this, e);
  DiffuseTransmissionBsdf b;
  const Field field{.name = "transmittance", .doc = "", .range = kUnit, .fallback = {.5, .5, .5}};
  p.read(field, b.transmittance);
  p.finish();
  b.reflectance = add_constant_texture({0, 0, 0});
  return add_bsdf(e, b);
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

// Reads a bsdf whose parameters are all listed by describe() (core/scene/schema). Also reads two notations
// that several kinds of bsdfs share: a metal given by its name, and one roughness `alpha` for both
// directions. Kinds of bsdfs that need more have specialisations below.
template <class Kind>
std::optional<BsdfIndex> Reader::read_bsdf_as(const Element& e) {
  Params p(*this, e);
  Kind b;
  if constexpr (requires { b.eta, b.k; }) read_metal_preset(p, b.eta, b.k);
  if constexpr (std::is_same_v<Kind, CoatedConductorBsdf>) {
    bind_alphas(p, b, kNonNegative);
  } else if constexpr (requires { b.alpha_u; }) {
    bind_alphas(p, b, kPositive);
    b.alpha_u = old_number(e, b.alpha_u);
    b.alpha_v = old_number(e, b.alpha_v);
    if (b.multiple_scattering) check_multiple_scattering(e, b.alpha_u, b.alpha_v);
  } else {
    bind(p, b);
  }
  p.finish();
  if constexpr (std::is_same_v<Kind, DiffuseTransmissionBsdf>) check_sum(e, b);
  return add_bsdf(e, b);
}

// Returns the nested bsdfs in the order of the file. As in Mitsuba, the two bsdfs of a blend are ordered by
// their names instead if both have a name.
std::optional<std::vector<BsdfIndex>> Reader::read_inner_bsdfs(Params& p, std::size_t at_least,
                                                               std::size_t at_most) {
  auto nested = p.take_nested("bsdf");
  p.finish();
  if (nested.size() < at_least || nested.size() > at_most) {
    const auto wanted = at_least == at_most ? (at_most == 1 ? "one nested bsdf" : "two nested bsdfs")
                                            : "one or two nested bsdfs";
    return report_.refuse(p.object().at,
                          fmt::format("{} needs {}, not {}", p.title(), wanted, nested.size()));
  }
  const bool blend = p.object().get("type") == "blendbsdf";
  const auto named = [](const auto& n) { return !n.use->get("name").empty(); };
  if (blend && std::all_of(nested.begin(), nested.end(), named))
    std::stable_sort(nested.begin(), nested.end(),
                     [](const auto& a, const auto& b) { return a.use->get("name") < b.use->get("name"); });
  const bool two_sided = p.object().get("type") == "twosided";
  std::vector<BsdfIndex> inner;
  for (const auto& [object, use] : nested) {
    const auto index = bsdf(*object, *use);
    if (!index) return std::nullopt;
    if (two_sided && (traits(*index).transmits || traits(*index).two_sided))
      return report_.refuse(
          use->at, fmt::format("bsdf \"{}\" has two sides of its own: it can't stand in \"twosided\"",
                               object->get("type")));
    inner.push_back(*index);
  }
  return inner;
}

template <class T>
std::optional<BsdfIndex> Reader::add_around_one(Params& p, T& b) {
  const auto inner = read_inner_bsdfs(p, 1, 1);
  if (!inner) return std::nullopt;
  b.bsdf = inner->front();
  return add_bsdf(p.object(), b);
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<TwoSidedBsdf>(const Element& e) {
  Params p(*this, e);
  const auto sides = read_inner_bsdfs(p, 1, 2);
  if (!sides) return std::nullopt;
  return add_bsdf(e, TwoSidedBsdf{sides->front(), sides->back()});
}

// In version 3 a checkerboard that is used as a scalar has its two values exchanged, compared with one that
// is used as a colour (see CheckerboardTexture in scene.h). In version 0.x the values are not exchanged. So
// in files of version 0.x a checkerboard that is used as a scalar is replaced by one with swapped colours.
TextureIndex Reader::old_number(const Element& e, TextureIndex t) {
  if (!e.old || t.value >= scene_.textures.size()) return t;
  const auto* given = std::get_if<CheckerboardTexture>(&scene_.textures[t.value]);
  if (!given) return t;
  if (const auto it = old_numbers_.find(t); it != old_numbers_.end()) return it->second;
  const CheckerboardTexture as_colour = *given;  // a copy, since added() may move the list's elements
  // The depth of recursion is bounded, since nested textures were read within kMaxReferenceDepth.
  const CheckerboardTexture swapped{old_number(e, as_colour.color1), old_number(e, as_colour.color0),
                                    as_colour.to_uv};
  return old_numbers_[t] = added<TextureIndex>(swapped);
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<MaskBsdf>(const Element& e) {
  Params p(*this, e);
  MaskBsdf b;
  bind(p, b);
  b.opacity = old_number(e, b.opacity);
  // After an error a mask may have no texture.
  const bool known = b.opacity.value < scene_.textures.size();
  const auto* image = known ? std::get_if<BitmapTexture>(&scene_.textures[b.opacity.value]) : nullptr;
  if (image && image->channel == Channel::all) {
    BitmapTexture opacity = *image;  // a copy, because other objects may use the image's colour
    opacity.alpha = true;
    b.opacity = added<TextureIndex>(opacity);
  }
  return add_around_one(p, b);
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<BlendBsdf>(const Element& e) {
  Params p(*this, e);
  BlendBsdf b;
  bind(p, b);
  b.weight = old_number(e, b.weight);
  const auto inner = read_inner_bsdfs(p, 2, 2);
  if (!inner) return std::nullopt;
  b.first = inner->front();
  b.second = inner->back();
  return add_bsdf(e, b);
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<NormalMapBsdf>(const Element& e) {
  Params p(*this, e);
  NormalMapBsdf b;
  bind(p, b);
  return add_around_one(p, b);
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<BumpMapBsdf>(const Element& e) {
  Params p(*this, e);
  BumpMapBsdf b;
  if (!read_heights(p, b)) return std::nullopt;
  return add_around_one(p, b);
}

// Reads the texture of a bump map. The texture may have any name, or none.
bool Reader::read_heights(Params& p, BumpMapBsdf& b) {
  const bool named = p.has("texture");
  bind(p, b);
  const auto nested = named ? std::vector<Params::Nested>{} : p.take_nested("texture");
  if (nested.size() > 1)
    return report_.error(nested[1].use->at, fmt::format("{} has a second texture", p.title())), false;
  if (!nested.empty()) {
    const auto index = texture(*nested[0].object, *nested[0].use);
    if (!index) return false;
    b.texture = *index;
  }
  // After an error the texture may be missing.
  if (b.texture.value >= scene_.textures.size()) return false;
  if (std::holds_alternative<BitmapTexture>(scene_.textures[b.texture.value])) return true;
  report_.error(p.object().at,
                fmt::format("{} needs a texture \"bitmap\": others have no slopes", p.title()));
  return false;
}

template <>
std::optional<BsdfIndex> Reader::read_bsdf_as<PrincipledBsdf>(const Element& e) {
  Params p(*this, e);
  PrincipledBsdf b;
  if (p.has("eta") && p.has("specular"))
    report_.error(e.at, "bsdf \"principled\" gives both eta and specular; each follows from the other");
  bind(p, b);
  if (const Element* given = p.take("specular")) {
    double specular = .5;
    p.convert({.name = "specular", .doc = "", .range = kUnit}, *given, specular);
    b.eta = 2 / (1 - std::sqrt(.08 * specular)) - 1;
  }
  p.finish();
  if (b.spec_trans && b.spec_trans->value < scene_.textures.size())
    if (const auto* share = std::get_if<ConstantTexture>(&scene_.textures[b.spec_trans->value]))
      if (share->value == Rgb{0, 0, 0}) b.spec_trans.reset();
  if (b.multiple_scattering && b.anisotropic.value < scene_.textures.size()) {
    const auto* share = std::get_if<ConstantTexture>(&scene_.textures[b.anisotropic.value]);
    if (!share || share->value != Rgb{0, 0, 0})
      report_.error(e.at,
                    "multiple_scattering of bsdf \"principled\" needs the same roughness both ways: leave "
                    "anisotropic out, or multiple_scattering");
  }
  return add_bsdf(e, b);
}

std::optional<BsdfIndex> Reader::read_bsdf(const Element& e) {
  if (e.get("type") == "difftrans") return read_difftrans(e);
  std::optional<BsdfIndex> read;
  if (!with_kind_named<Bsdf>(e.get("type"), [&]<class Kind>() { read = read_bsdf_as<Kind>(e); }))
    unknown_plugin(e, report_);
  return read;
}

}  // namespace ls::scene
