#include "worker/render/bsdf/material_builder.h"

namespace ls::render {

void MaterialBuilder::refuse(std::string text) {
  if (!error_) error_ = Error{Errc::invalid_argument, std::move(text)};
}

Slot MaterialBuilder::slot(TextureIndex t) {
  if (t.value >= textures_.size()) {
    refuse(fmt::format("it names texture {} of {}", t.value, textures_.size()));
    return {};
  }
  return {textures_.constant(t), t, textures_.is_constant(t)};
}

Slot MaterialBuilder::reflectance(TextureIndex t) {
  Slot s = slot(t);
  if (!s.constant) return s;
  const C3 in(std::clamp(s.value.x, 0.f, 1.f), std::clamp(s.value.y, 0.f, 1.f),
              std::clamp(s.value.z, 0.f, 1.f));
  clamped_ += in != s.value;
  s.value = in;
  return s;
}

Roughness MaterialBuilder::roughness(Microfacet distribution, TextureIndex u, TextureIndex v) {
  const Roughness r{distribution, slot(u), slot(v)};
  for (const Slot* s : {&r.u, &r.v})
    if (s->constant && !(s->value.x >= 0))
      refuse(fmt::format("roughness alpha = {} is not a number >= 0", s->value.x));
  return r;
}

Roughness MaterialBuilder::roughness(Microfacet distribution, double alpha) {
  if (!(alpha >= 0) || !std::isfinite(alpha))
    refuse(fmt::format("roughness alpha = {} is not a number >= 0", alpha));
  const Slot s{C3(static_cast<float>(alpha)), {}, true};
  return {distribution, s, s};
}

double MaterialBuilder::index(double inside, double outside) {
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

float MaterialBuilder::mean(const Slot& s) const {
  return std::min(1.f, mean_component(s.constant ? s.value : textures_.mean(s.texture)));
}

BsdfIndex MaterialBuilder::side(BsdfIndex b) {
  if (traits_[b.value].transmits) refuse("a two-sided material cannot hold one that lets light through");
  while (const auto* nested = std::get_if<TwoSidedBsdf>(&scene_.bsdfs[b.value])) b = nested->front;
  return b;
}

const RoughPlasticTable& MaterialBuilder::coat(Microfacet type, double alpha, double eta) {
  const auto [it, fresh] = coats_.try_emplace({type, alpha, eta});
  if (fresh) it->second = make_rough_plastic_table(type, alpha, eta);
  return it->second;
}

const CoatedConductorTables& MaterialBuilder::coated_conductor(
    const std::array<float, 4>& parameters, const std::function<CoatedConductorTables()>& make) {
  const auto it = coated_conductors_.find(parameters);
  return it != coated_conductors_.end() ? it->second
                                        : coated_conductors_.emplace(parameters, make()).first->second;
}

const MicrofacetEnergy* MaterialBuilder::energy(EnergyOf of, const Roughness& r, double eta) {
  if (refused()) return nullptr;
  if (!r.u.constant || !r.v.constant || r.u.value.x != r.v.value.x) {
    refuse("multiple_scattering needs one roughness that is a number, not a texture");
    return nullptr;
  }
  return energy(of, r.distribution, double{r.u.value.x}, eta);
}

const MicrofacetEnergy* MaterialBuilder::energy(EnergyOf of, Microfacet type, double alpha, double eta) {
  const auto [it, fresh] = known_energies_.try_emplace({of, type, alpha, eta});
  if (!fresh) return it->second;
  energies_.push_back(
      std::make_unique<MicrofacetEnergy>(of == EnergyOf::conductor    ? conductor_energy(type, alpha)
                                         : of == EnergyOf::dielectric ? dielectric_energy(type, alpha, eta)
                                                                      : coat_energy(type, alpha, eta)));
  return it->second = energies_.back().get();
}

}  // namespace ls::render
