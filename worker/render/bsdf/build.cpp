#include <fmt/format.h>

#include <map>
#include <tuple>

#include "common/base/overloaded.h"
#include "worker/render/bsdf/material.h"

namespace ls::render {

BsdfTable::BsdfTable() = default;
BsdfTable::~BsdfTable() = default;
BsdfTable::BsdfTable(BsdfTable&&) noexcept = default;
BsdfTable& BsdfTable::operator=(BsdfTable&&) noexcept = default;

namespace {

using Material = BsdfTable::Material;

// Collects the first error, so that the conversions below read as tables.
class Builder {
 public:
  Builder(const Scene& scene, const TextureTable& textures) : scene_(scene), textures_(textures) {}

  std::optional<Error> error;
  std::uint64_t clamped = 0;

  Material operator()(const DiffuseBsdf& b) {
    Material m = make(MaterialKind::diffuse);
    m.second_slot = reflectance(b.reflectance);
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
    if (mirror(m)) m.kind = MaterialKind::conductor;
    return m;
  }
  Material operator()(const DielectricBsdf& b) {
    Material m = make(MaterialKind::dielectric);
    m.ior = static_cast<float>(index(b.int_ior, b.ext_ior));
    m.specular_slot = reflectance(b.specular_reflectance);
    m.second_slot = reflectance(b.specular_transmittance);
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
    m.second_slot = reflectance(b.diffuse_reflectance);
    m.specular_slot = reflectance(b.specular_reflectance);
    if (error) return m;
    const float d = mean(m.second_slot), s = mean(m.specular_slot);
    m.specular_weight = d + s > 0 ? s / (d + s) : 1;
    m.coat = coat(b.distribution, b.alpha, eta);
    return m;
  }
  Material operator()(const NullBsdf&) { return make(MaterialKind::null); }
  Material operator()(const TwoSidedBsdf& b) {
    Material m = make(MaterialKind::two_sided);
    m.front = side(b.front);
    m.back = side(b.back);
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
  // Integrated once for all materials alike: a table takes 30 ms, and scenes colour many objects the same way.
  const RoughPlasticTable& coat(Microfacet type, double alpha, double eta) {
    const auto [it, fresh] = coats_.try_emplace({type, alpha, eta});
    if (fresh) it->second = make_rough_plastic_table(type, alpha, eta);
    return it->second;
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
  // Surfaces never reflect more than they get: what lies outside [0, 1] is brought in, and counted.
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
  static bool mirror(const Material& m) {
    return m.alpha_u.constant && m.alpha_v.constant && m.alpha_u.value.x < kSpecularAlpha &&
           m.alpha_v.value.x < kSpecularAlpha;
  }
  void metal(Material& m, const Rgb& eta, const Rgb& k, TextureIndex specular) {
    for (int c = 0; c < 3; ++c) {
      m.eta[c] = static_cast<float>(eta[c]);
      m.k[c] = static_cast<float>(k[c]);
      if (!(m.eta[c] >= 0) || !(m.k[c] >= 0) || !std::isfinite(m.eta[c]) || !std::isfinite(m.k[c]))
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
  // What a side of a two-sided material really is. A two-sided one there shows its front, from both sides.
  std::uint32_t side(BsdfIndex b) {
    for (std::size_t steps = 0; steps <= scene_.bsdfs.size(); ++steps) {
      if (b.value >= scene_.bsdfs.size()) break;
      const Bsdf& bsdf = scene_.bsdfs[b.value];
      if (std::holds_alternative<NullBsdf>(bsdf) || std::holds_alternative<DielectricBsdf>(bsdf)) {
        refuse("a two-sided material cannot hold one that lets light through");
        return 0;
      }
      const auto* nested = std::get_if<TwoSidedBsdf>(&bsdf);
      if (!nested) return b.value;
      b = nested->front;
    }
    refuse("a two-sided material names a material that does not exist, or itself");
    return 0;
  }

  const Scene& scene_;
  const TextureTable& textures_;
  std::map<std::tuple<Microfacet, double, double>, RoughPlasticTable> coats_;
};

}  // namespace

Result<BsdfTable> BsdfTable::build(const Scene& scene, const TextureTable& textures) {
  BsdfTable table;
  table.textures_ = &textures;
  Builder builder(scene, textures);
  table.materials_.reserve(scene.bsdfs.size());
  for (const Bsdf& b : scene.bsdfs) {
    table.materials_.push_back(std::visit(builder, b));
    if (builder.error)
      return fail(builder.error->code,
                  fmt::format("material {}: {}", table.materials_.size() - 1, builder.error->message));
  }
  table.clamped_ = builder.clamped;
  return table;
}

std::size_t BsdfTable::size() const { return materials_.size(); }
std::uint64_t BsdfTable::bytes() const { return materials_.size() * sizeof(Material); }
std::uint64_t BsdfTable::clamped_inputs() const { return clamped_; }

bool BsdfTable::is_null(BsdfIndex i) const { return materials_[i.value].kind == MaterialKind::null; }
bool BsdfTable::transmits(BsdfIndex i) const {
  const MaterialKind k = materials_[i.value].kind;
  return k == MaterialKind::null || k == MaterialKind::dielectric;
}
bool BsdfTable::has_smooth(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  switch (m.kind) {
    case MaterialKind::diffuse:
    case MaterialKind::rough_conductor:
    case MaterialKind::rough_plastic:
      return true;
    case MaterialKind::two_sided:
      return has_smooth({m.front}) || has_smooth({m.back});
    default:
      return false;
  }
}
bool BsdfTable::reads_uv(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  if (m.kind == MaterialKind::two_sided) return reads_uv({m.front}) || reads_uv({m.back});
  return !(m.specular_slot.constant && m.second_slot.constant && m.alpha_u.constant && m.alpha_v.constant);
}
bool BsdfTable::anisotropic(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  if (m.kind == MaterialKind::two_sided) return anisotropic({m.front}) || anisotropic({m.back});
  const bool same = m.alpha_u.constant ? m.alpha_v.constant && m.alpha_u.value == m.alpha_v.value
                                       : !m.alpha_v.constant && m.alpha_u.texture == m.alpha_v.texture;
  return m.kind == MaterialKind::rough_conductor && !same;
}

}  // namespace ls::render
