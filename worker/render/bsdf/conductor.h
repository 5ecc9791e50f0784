// Metals, smooth and rough.
#pragma once

#include "worker/render/bsdf/material_builder.h"
#include "worker/render/bsdf/microfacet_energy.h"

namespace ls::render {

struct Metal {
  C3 eta, k, tint;
  C3 reflectance(float cos) const { return fresnel_conductor(std::min(cos, 1.f), eta, k) * tint; }
};

struct Conductor : MaterialKind {
  C3 eta{0, 0, 0}, k{1, 1, 1};
  Slot tint;

  bool reads_uv() const { return any_texture(tint); }
  Metal metal(const Lookup& look) const { return {eta, k, look.reflectance(tint)}; }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float, const V2&) const {
    return sample_mirror(metal(look).reflectance(wo.z), wo);
  }
};

struct RoughConductor : Conductor {
  static constexpr bool kSmooth = true;
  Roughness roughness;
  const MicrofacetEnergy* energy = nullptr;  // null unless the material has multiple_scattering
  C3 mean_fresnel{1, 1, 1};                  // set only with multiple_scattering

  bool reads_uv() const { return any_texture(tint, roughness.u, roughness.v); }
  bool anisotropic() const { return !roughness.same_along_both(); }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    const auto rough = look.roughness(roughness);
    if (rough.mirror) return {};
    const Metal m = metal(look);
    BsdfEval e = eval_facets(m, rough.facets, wo, wi);
    if (energy) e.f_cos *= energy->factor(wo.z, m.tint * mean_fresnel);
    return e;
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float, const V2& u) const {
    const auto rough = look.roughness(roughness);
    auto s = rough.mirror ? sample_mirror(metal(look).reflectance(wo.z), wo)
                          : sample_facets(metal(look), rough.facets, wo, u);
    if (s && energy) s->weight *= energy->factor(wo.z, metal(look).tint * mean_fresnel);
    return s;
  }

 private:
  static BsdfEval eval_facets(const Metal& metal, const Microfacets& facets, const V3& wo, const V3& wi) {
    const V3 h = normalize(wo + wi);
    const float D = facets.D(h), G = facets.G1_over_cos(wo) * facets.G1_over_cos(wi) * wi.z;
    return {metal.reflectance(dot(wo, h)) * (.25f * D * G), D * facets.pdf_over_D(wo)};
  }
  // The weight is F G1(wi) times a ratio near 1. D, which may be huge or lose digits, cancels.
  static std::optional<BsdfSample> sample_facets(const Metal& metal, const Microfacets& facets, const V3& wo,
                                                 const V2& u) {
    const V3 h = facets.sample_normal(wo, u);
    const V3 wi = normalize(reflect(wo, h));
    const float pdf_over_D = facets.pdf_over_D(wo), pdf = facets.D(h) * pdf_over_D;
    if (!(wi.z > 0) || !(pdf > 0)) return std::nullopt;
    const float ratio = .25f * facets.G1_over_cos(wo) / pdf_over_D;
    BsdfSample s;
    s.wi = wi;
    s.weight = metal.reflectance(dot(wo, h)) * (facets.G1_over_cos(wi) * wi.z * ratio);
    s.pdf = pdf;
    return s;
  }
};

using ConductorKinds = Kinds<Conductor, RoughConductor>;

template <class Description>
void set_metal(Conductor& m, const Description& b, MaterialBuilder& builder) {
  // The largest index of a metal. A metal with this index reflects all but 4e-9 of the light, which is total
  // reflection in float32; larger indices would overflow the fourth powers in fresnel_conductor.
  constexpr double kLargestIndex = 1e9;
  for (int c = 0; c < 3; ++c) {
    const double eta = b.eta[c], k = b.k[c];
    m.eta[c] = static_cast<float>(std::min(eta, kLargestIndex));
    m.k[c] = static_cast<float>(std::min(k, kLargestIndex));
    if (!(eta >= 0) || !(k >= 0) || !std::isfinite(eta) || !std::isfinite(k))
      builder.refuse(fmt::format("the conductor's index {} + {} i is not finite and >= 0", eta, k));
  }
  m.tint = builder.reflectance(b.specular_reflectance);
}

inline Conductor make_material(const ConductorBsdf& b, MaterialBuilder& builder) {
  Conductor m;
  set_metal(m, b, builder);
  return m;
}
inline std::variant<Conductor, RoughConductor> make_material(const RoughConductorBsdf& b,
                                                             MaterialBuilder& builder) {
  RoughConductor m;
  set_metal(m, b, builder);
  m.roughness = builder.roughness(b.distribution, b.alpha_u, b.alpha_v);
  if (m.roughness.always_mirror()) return static_cast<const Conductor&>(m);
  if (b.multiple_scattering) {
    m.energy = builder.energy(MaterialBuilder::EnergyOf::conductor, m.roughness, 1);
    m.mean_fresnel = mean_fresnel(m.eta, m.k);
  }
  return m;
}

}  // namespace ls::render
