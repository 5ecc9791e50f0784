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

bool MaterialBuilder::room_for_table() {
  const bool room = coats_.size() + energies_.size() + coated_conductors_.size() <= kMostTables;
  if (!room)
    refuse(
        fmt::format("the scene has more than {} rough materials whose roughness or index of refraction "
                    "differs: round them, so that materials share their tables",
                    kMostTables));
  return room;
}

const RoughPlasticTable& MaterialBuilder::coat(Microfacet type, double alpha, double eta) {
  const auto [it, fresh] = coats_.try_emplace({type, alpha, eta});
  if (fresh && room_for_table()) it->second = make_rough_plastic_table(type, alpha, eta);
  return it->second;
}

const CoatedConductorTables& MaterialBuilder::coated_conductor(
    const std::array<float, 4>& parameters, const std::function<CoatedConductorTables()>& make) {
  const auto [it, fresh] = coated_conductors_.try_emplace(parameters);
  if (fresh && room_for_table()) it->second = make();
  return it->second;
}

const MicrofacetEnergy* MaterialBuilder::energy(EnergyOf of, const Roughness& r, double eta) {
  if (refused()) return nullptr;
  if (!r.u.constant || !r.v.constant || r.u.value.x != r.v.value.x) {
    refuse("multiple_scattering needs one roughness that is a number, not a texture");
    return nullptr;
  }
  return energy(of, r.distribution, double{r.u.value.x}, eta);
}

const MicrofacetEnergy* MaterialBuilder::energy(EnergyOf of, Microfacet type, double alpha, double eta,
                                                Accuracy accuracy) {
  const auto [it, fresh] = known_energies_.try_emplace({of, type, alpha, eta, accuracy});
  if (!fresh) return it->second;
  energies_.push_back(nullptr);
  if (!room_for_table()) return nullptr;
  energies_.back() = std::make_unique<MicrofacetEnergy>(
      of == EnergyOf::conductor    ? conductor_energy(type, alpha, accuracy)
      : of == EnergyOf::dielectric ? dielectric_energy(type, alpha, eta, accuracy)
                                   : coat_energy(type, alpha, eta));
  return it->second = energies_.back().get();
}

EnergyByRoughness MaterialBuilder::energies(EnergyOf of, const Slot& roughness, double eta) {
  std::vector<const MicrofacetEnergy*> tables;
  const auto add = [&](float r, Accuracy accuracy) {
    const double alpha = double{std::max(kMinPrincipled, r * r)};
    if (!refused()) tables.push_back(energy(of, Microfacet::ggx, alpha, eta, accuracy));
  };
  if (roughness.constant)
    add(std::clamp(luminance(roughness.value), 0.f, 1.f), Accuracy::full);
  else
    for (int i = 0; i <= EnergyByRoughness::kSteps; ++i)
      add(static_cast<float>(i) / EnergyByRoughness::kSteps, Accuracy::rough);
  return refused() ? EnergyByRoughness() : EnergyByRoughness(std::move(tables));
}

}  // namespace ls::render
