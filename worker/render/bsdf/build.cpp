#include <fmt/format.h>

#include <map>
#include <tuple>

#include "common/base/overloaded.h"
#include "common/scene/limits.h"
#include "common/scene/schema/bsdf_traits.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/material.h"
#include "worker/render/bsdf/principled.h"

namespace ls::render {

BsdfTable::BsdfTable() = default;
BsdfTable::~BsdfTable() = default;
BsdfTable::BsdfTable(BsdfTable&&) noexcept = default;
BsdfTable& BsdfTable::operator=(BsdfTable&&) noexcept = default;

namespace {

using Material = BsdfTable::Material;

// Builds the table of materials. It records only the first error and goes on, so that the conversions below
// need no error handling of their own and read as tables.
class Builder {
 public:
  Builder(const Scene& scene, const TextureTable& textures, const std::vector<scene::BsdfTraits>& traits)
      : scene_(scene), textures_(textures), traits_(traits) {}

  std::optional<Error> error;
  std::uint64_t clamped = 0;
  std::vector<BsdfTable::Principled> principled;
  std::vector<std::unique_ptr<const MicrofacetEnergy>> energies;

  Material operator()(const DiffuseBsdf& b) {
    Material m = make(MaterialKind::diffuse);
    m.second_slot = reflectance(b.reflectance);
    if (!m.second_slot.constant) m.kind = MaterialKind::textured_diffuse;
    return m;
  }
  Material operator()(const ConductorBsdf& b) {
    Material m = make(MaterialKind::conductor);
    metal(m, b.eta, b.k, b.specular_reflectance);
    return m;
  }
  Material operator()(const RoughConductorBsdf& b) {
    Material m = make(MaterialKind::rough_conductor);
    metal(m, b.eta, b.k, b.specular_reflectance);
    m.distribution = b.distribution;
    m.alpha_u = roughness(b.alpha_u);
    m.alpha_v = roughness(b.alpha_v);
    if (mirror(m)) {
      m.kind = MaterialKind::conductor;
    } else if (b.multiple_scattering) {
      m.energy = energy(EnergyOf::conductor, m, alpha_of(m), 1);
      m.mean_fresnel = mean_fresnel(m.eta, m.k);
    }
    return m;
  }
  Material operator()(const DielectricBsdf& b) {
    Material m = make(MaterialKind::dielectric);
    m.ior = static_cast<float>(index(b.int_ior, b.ext_ior));
    m.specular_slot = reflectance(b.specular_reflectance);
    m.second_slot = reflectance(b.specular_transmittance);
    return m;
  }
  Material operator()(const RoughDielectricBsdf& b) {
    Material m = make(MaterialKind::rough_dielectric);
    m.ior = static_cast<float>(index(b.int_ior, b.ext_ior));
    m.distribution = b.distribution;
    m.alpha_u = roughness(b.alpha_u);
    m.alpha_v = roughness(b.alpha_v);
    m.specular_slot = reflectance(b.specular_reflectance);
    m.second_slot = reflectance(b.specular_transmittance);
    // Facets of slope t deflect refracted light by about (ior - 1) t. For an ior this close to 1 that is
    // invisible, but the lobe would be too narrow for float32; so the boundary is treated as smooth.
    if (mirror(m) || std::abs(m.ior - 1) < kSpecularAlpha)
      m.kind = MaterialKind::dielectric;
    else if (b.multiple_scattering)
      m.energy = energy(EnergyOf::dielectric, m, alpha_of(m), index(b.int_ior, b.ext_ior));
    return m;
  }
  Material operator()(const ThinDielectricBsdf& b) {
    Material m = make(MaterialKind::thin_dielectric);
    m.null_transmission = true;
    m.ior = static_cast<float>(index(b.int_ior, b.ext_ior));
    m.specular_slot = reflectance(b.specular_reflectance);
    m.second_slot = reflectance(b.specular_transmittance);
    return m;
  }
  Material operator()(const PlasticBsdf& b) {
    Material m = make(MaterialKind::plastic);
    const double eta = index(b.int_ior, b.ext_ior);
    m.nonlinear = b.nonlinear;
    m.ior = static_cast<float>(eta);
    m.specular = true;
    coat_and_base(m, b.diffuse_reflectance, b.specular_reflectance);
    m.coat.internal_reflectance = static_cast<float>(internal_diffuse_reflectance(eta));
    return m;
  }
  Material operator()(const RoughPlasticBsdf& b) {
    Material m = make(MaterialKind::rough_plastic);
    const double eta = index(b.int_ior, b.ext_ior);
    if (!(b.alpha >= 0) || !std::isfinite(b.alpha))
      refuse(fmt::format("roughness alpha = {} is not a number >= 0", b.alpha));
    if (error) return m;
    m.distribution = b.distribution;
    m.nonlinear = b.nonlinear;
    m.ior = static_cast<float>(eta);
    m.specular = b.alpha < kSpecularAlpha;
    m.alpha_u = m.alpha_v = Slot{C3(static_cast<float>(b.alpha)), {}, true};
    coat_and_base(m, b.diffuse_reflectance, b.specular_reflectance);
    if (error) return m;
    if (b.multiple_scattering) {
      m.energy = energy(EnergyOf::coat, m, b.alpha, eta);
      // The share of diffuse light from inside that the coat reflects back: by reciprocity, light from inside
      // is transmitted 1 / eta^2 times as much as light from outside.
      if (m.energy)
        m.coat.internal_reflectance = static_cast<float>(1 - m.energy->through.mean() / (eta * eta));
    } else {
      m.coat = coat(b.distribution, b.alpha, eta);
    }
    return m;
  }
  Material operator()(const NullBsdf&) { return make(MaterialKind::null); }
  Material operator()(const TwoSidedBsdf& b) {
    Material m = make(MaterialKind::two_sided);
    m.front = side(b.front);
    m.back = side(b.back);
    return m;
  }
  Material operator()(const MaskBsdf& b) {
    Material m = make(MaterialKind::mask);
    m.null_transmission = true;
    m.specular_slot = reflectance(b.opacity);
    m.front = b.bsdf.value;
    return m;
  }
  Material operator()(const BlendBsdf& b) {
    Material m = make(MaterialKind::blend);
    m.null_transmission = traits_[b.first.value].passes || traits_[b.second.value].passes;
    m.specular_slot = reflectance(b.weight);
    m.front = b.first.value;
    m.back = b.second.value;
    return m;
  }
  Material operator()(const NormalMapBsdf& b) {
    Material m = make(MaterialKind::normal_map);
    m.null_transmission = traits_[b.bsdf.value].passes;
    m.specular_slot = slot(b.normalmap);
    m.flips = b.flip_invalid_normals;
    m.shadows = b.use_shadowing_function;
    m.front = b.bsdf.value;
    return m;
  }
  Material operator()(const BumpMapBsdf& b) {
    Material m = make(MaterialKind::bump_map);
    m.null_transmission = traits_[b.bsdf.value].passes;
    m.specular_slot = slot(b.texture);
    m.flips = b.flip_invalid_normals;
    m.shadows = b.use_shadowing_function;
    m.specular_weight = static_cast<float>(b.scale);
    if (!std::isfinite(m.specular_weight)) refuse(fmt::format("a bump map's scale is {}", b.scale));
    m.front = b.bsdf.value;
    return m;
  }
  Material operator()(const PrincipledBsdf& b) {
    Material m = make(MaterialKind::principled);
    m.front = static_cast<std::uint32_t>(principled.size());
    BsdfTable::Principled p;
    p.base_color = reflectance(b.base_color);
    p.roughness = reflectance(b.roughness);
    p.anisotropic = reflectance(b.anisotropic);
    p.metallic = reflectance(b.metallic);
    p.spec_tint = reflectance(b.spec_tint);
    p.sheen = reflectance(b.sheen);
    p.sheen_tint = reflectance(b.sheen_tint);
    p.flatness = reflectance(b.flatness);
    p.clearcoat = reflectance(b.clearcoat);
    p.clearcoat_gloss = reflectance(b.clearcoat_gloss);
    p.transmits = b.spec_trans.has_value();
    p.spec_trans = b.spec_trans ? reflectance(*b.spec_trans) : Slot{C3(0), {}, true};
    p.eta = static_cast<float>(index(b.eta, 1));
    // As in Mitsuba, the index is kept away from 1, because without a contrast of indices the facets neither
    // reflect nor refract.
    if (p.transmits && std::abs(p.eta - 1) < 1e-3f) p.eta = 1.001f;
    principled.push_back(p);
    return m;
  }

 private:
  static Material make(MaterialKind kind) {
    Material m;
    m.kind = kind;
    return m;
  }
  void refuse(std::string text) {
    if (!error) error = Error{Errc::invalid_argument, std::move(text)};
  }
  void coat_and_base(Material& m, TextureIndex diffuse, TextureIndex specular) {
    m.second_slot = reflectance(diffuse);
    m.specular_slot = reflectance(specular);
    if (error) return;
    const float d = mean(m.second_slot), s = mean(m.specular_slot);
    m.specular_weight = d + s > 0 ? s / (d + s) : 1;
  }
  // The table of a plastic's coat. It is integrated once for all materials with equal parameters, because
  // that takes 30 ms and scenes give many objects the same coat.
  const RoughPlasticTable& coat(Microfacet type, double alpha, double eta) {
    const auto [it, fresh] = coats_.try_emplace({type, alpha, eta});
    if (fresh) it->second = make_rough_plastic_table(type, alpha, eta);
    return it->second;
  }
  // The table of multiple scattering between microfacets. Like coat(), it is integrated once for all
  // materials with equal parameters.
  enum class EnergyOf { conductor, dielectric, coat };
  const MicrofacetEnergy* energy(EnergyOf of, const Material& m, double alpha, double eta) {
    if (error) return nullptr;
    if (!m.alpha_u.constant || !m.alpha_v.constant || m.alpha_u.value.x != m.alpha_v.value.x) {
      refuse("multiple_scattering needs one roughness that is a number, not a texture");
      return nullptr;
    }
    const auto [it, fresh] = energies_.try_emplace({of, m.distribution, alpha, eta});
    if (!fresh) return it->second;
    energies.push_back(std::make_unique<MicrofacetEnergy>(
        of == EnergyOf::conductor    ? conductor_energy(m.distribution, alpha)
        : of == EnergyOf::dielectric ? dielectric_energy(m.distribution, alpha, eta)
                                     : coat_energy(m.distribution, alpha, eta)));
    return it->second = energies.back().get();
  }
  float mean(const Slot& s) const {
    return std::min(1.f, mean_component(s.constant ? s.value : textures_.mean(s.texture)));
  }

  Slot slot(TextureIndex t) {
    if (t.value >= textures_.size()) {
      refuse(fmt::format("it names texture {} of {}", t.value, textures_.size()));
      return {};
    }
    return {textures_.constant(t), t, textures_.is_constant(t)};
  }
  // The Slot of a reflectance. Values outside [0, 1] are clamped, so that surfaces conserve energy, and
  // counted.
  Slot reflectance(TextureIndex t) {
    Slot s = slot(t);
    if (!s.constant) return s;
    const C3 in(std::clamp(s.value.x, 0.f, 1.f), std::clamp(s.value.y, 0.f, 1.f),
                std::clamp(s.value.z, 0.f, 1.f));
    clamped += in != s.value;
    s.value = in;
    return s;
  }
  Slot roughness(TextureIndex t) {
    const Slot s = slot(t);
    if (s.constant && !(s.value.x >= 0))
      refuse(fmt::format("roughness alpha = {} is not a number >= 0", s.value.x));
    return s;
  }
  static double alpha_of(const Material& m) { return double{m.alpha_u.value.x}; }
  static bool mirror(const Material& m) {
    return m.alpha_u.constant && m.alpha_v.constant && m.alpha_u.value.x < kSpecularAlpha &&
           m.alpha_v.value.x < kSpecularAlpha;
  }
  void metal(Material& m, const Rgb& eta, const Rgb& k, TextureIndex specular) {
    // The largest index of a metal. With this index it reflects all but 4e-9 of the light, which is
    // everything in float32; larger indices would overflow the fourth powers in fresnel_conductor.
    constexpr double kLargestIndex = 1e9;
    for (int c = 0; c < 3; ++c) {
      m.eta[c] = static_cast<float>(std::min(eta[c], kLargestIndex));
      m.k[c] = static_cast<float>(std::min(k[c], kLargestIndex));
      if (!(eta[c] >= 0) || !(k[c] >= 0) || !std::isfinite(eta[c]) || !std::isfinite(k[c]))
        refuse(fmt::format("the conductor's index {} + {} i is not finite and >= 0", eta[c], k[c]));
    }
    m.specular_slot = reflectance(specular);
  }
  double index(double inside, double outside) {
    const double eta = inside / outside;
    if (!(inside > 0) || !(outside > 0) || !(eta >= 1e-3 && eta <= 1e3)) {
      refuse(
          fmt::format("the indices of refraction {} (inside) and {} (outside) are not positive numbers of a "
                      "sensible ratio",
                      inside, outside));
      return 1;
    }
    return eta;
  }
  // The index of the material to use for one side of a two-sided material, whose material there is b. If b is
  // itself two-sided, its front is used for both sides.
  std::uint32_t side(BsdfIndex b) {
    if (traits_[b.value].transmits) refuse("a two-sided material cannot hold one that lets light through");
    while (const auto* nested = std::get_if<TwoSidedBsdf>(&scene_.bsdfs[b.value])) b = nested->front;
    return b.value;
  }

  const Scene& scene_;
  const TextureTable& textures_;
  const std::vector<scene::BsdfTraits>& traits_;
  std::map<std::tuple<Microfacet, double, double>, RoughPlasticTable> coats_;
  std::map<std::tuple<EnergyOf, Microfacet, double, double>, const MicrofacetEnergy*> energies_;
};

// True if `holds` is true for any of the materials that m consists of.
template <class F>
bool any_part(const Material& m, F holds) {
  switch (m.kind) {
    case MaterialKind::two_sided:
    case MaterialKind::blend:
      return holds(BsdfIndex{m.front}) || holds(BsdfIndex{m.back});
    case MaterialKind::mask:
    case MaterialKind::normal_map:
    case MaterialKind::bump_map:
      return holds(BsdfIndex{m.front});
    default:
      return false;
  }
}

}  // namespace

Result<BsdfTable> BsdfTable::build(const Scene& scene, const TextureTable& textures) {
  BsdfTable table;
  table.textures_ = &textures;
  const auto traits = scene::bsdf_traits(scene);
  if (!traits)
    return fail(
        Errc::invalid_argument,
        fmt::format("a material contains one that does not exist, or itself, or materials nested more "
                    "than {} deep",
                    scene::kMaxBsdfNesting));
  Builder builder(scene, textures, *traits);
  table.materials_.reserve(scene.bsdfs.size());
  for (const Bsdf& b : scene.bsdfs) {
    table.materials_.push_back(std::visit(builder, b));
    if (builder.error)
      return fail(builder.error->code,
                  fmt::format("material {}: {}", table.materials_.size() - 1, builder.error->message));
  }
  table.clamped_ = builder.clamped;
  table.principled_ = std::move(builder.principled);
  table.energies_ = std::move(builder.energies);
  return table;
}

std::size_t BsdfTable::size() const { return materials_.size(); }
std::uint64_t BsdfTable::bytes() const {
  std::uint64_t energies = 0;
  for (const auto& e : energies_) energies += e->bytes();
  return materials_.size() * sizeof(Material) + principled_.size() * sizeof(Principled) + energies;
}
std::uint64_t BsdfTable::clamped_inputs() const { return clamped_; }

bool BsdfTable::is_null(BsdfIndex i) const { return materials_[i.value].kind == MaterialKind::null; }
bool BsdfTable::has_null_transmission(BsdfIndex i) const { return materials_[i.value].null_transmission; }
bool BsdfTable::has_smooth(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  switch (m.kind) {
    case MaterialKind::diffuse:
    case MaterialKind::textured_diffuse:
    case MaterialKind::rough_conductor:
    case MaterialKind::rough_plastic:
    case MaterialKind::plastic:
    case MaterialKind::rough_dielectric:
    case MaterialKind::principled:
      return true;
    default:
      return any_part(m, [&](BsdfIndex part) { return has_smooth(part); });
  }
}
bool BsdfTable::reads_uv(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  if (m.kind == MaterialKind::principled) return principled_[m.front].reads_uv();
  return !(m.specular_slot.constant && m.second_slot.constant && m.alpha_u.constant && m.alpha_v.constant) ||
         any_part(m, [&](BsdfIndex part) { return reads_uv(part); });
}
bool BsdfTable::anisotropic(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  if (m.kind == MaterialKind::normal_map || m.kind == MaterialKind::bump_map) return true;
  if (m.kind == MaterialKind::principled) return principled_[m.front].is_anisotropic();
  const bool same = m.alpha_u.constant ? m.alpha_v.constant && m.alpha_u.value == m.alpha_v.value
                                       : !m.alpha_v.constant && m.alpha_u.texture == m.alpha_v.texture;
  return ((m.kind == MaterialKind::rough_conductor || m.kind == MaterialKind::rough_dielectric) && !same) ||
         any_part(m, [&](BsdfIndex part) { return anisotropic(part); });
}
bool BsdfTable::reads_slopes(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  return m.kind == MaterialKind::bump_map || any_part(m, [&](BsdfIndex part) { return reads_slopes(part); });
}

}  // namespace ls::render
