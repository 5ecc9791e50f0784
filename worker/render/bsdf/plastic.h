// Plastics: a dielectric coat, smooth or rough, over a diffuse base.
#pragma once

#include "worker/render/bsdf/material_builder.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render {

inline float coat_reflectance(float cos, float ior) {
  return static_cast<float>(fresnel_dielectric(cos, ior).reflectance);
}

// The parameters of a plastic at one point, for one direction wo.
template <class Kind>
struct SeenPlastic {
  const Kind& m;
  C3 diffuse, tint;
  float t_o;         // the coat's transmittance towards wo
  float p_specular;  // probability of sampling the coat

  SeenPlastic(const Kind& material, const Lookup& look, const V3& wo)
      : m(material),
        diffuse(look.reflectance(m.diffuse)),
        tint(look.reflectance(m.specular)),
        t_o(m.through(wo.z)) {
    const float s = (1 - t_o) * m.specular_weight, d = t_o * (1 - m.specular_weight);
    p_specular = s + d > 0 ? s / (s + d) : .5f;
  }

  // The part of the BSDF, times |cos wi|, for light that enters through the coat, is scattered any number of
  // times below it, and leaves again.
  C3 diffuse_f_cos(const V3& wi) const {
    const float r = m.internal_reflectance;
    const C3 inside = m.nonlinear ? C3(1) - diffuse * r : C3(1 - r);
    return diffuse / inside * (kInvPi / (m.ior * m.ior) * wi.z * t_o * m.through(wi.z));
  }

  BsdfEval eval(const V3& wo, const V3& wi) const {
    BsdfEval e{diffuse_f_cos(wi), (1 - p_specular) * wi.z * kInvPi};
    if constexpr (Kind::kHasFacets) {
      if (m.mirror) return e;
      const V3 h = normalize(wo + wi);
      const float D = m.facets.D(h), G = m.facets.G1_over_cos(wo) * m.facets.G1_over_cos(wi) * wi.z;
      C3 coat = tint * (coat_reflectance(dot(wo, h), m.ior) * .25f * D * G);
      if (m.energy) coat *= m.energy->factor(wo.z, true);
      e.f_cos += coat;
      e.pdf += p_specular * D * m.facets.pdf_over_D(wo);
    }
    return e;
  }

  std::optional<BsdfSample> sample(const V3& wo, float u_lobe, const V2& u) const {
    const bool coat = u_lobe < p_specular;
    if (coat && m.mirror) {
      auto s = sample_mirror(tint * (coat_reflectance(wo.z, m.ior) / p_specular), wo);
      s->pdf = p_specular;
      return s;
    }
    BsdfSample s;
    s.wi = coat ? normalize(reflect(wo, m.facets.sample_normal(wo, u))) : cosine_hemisphere(u);
    if (!(s.wi.z > 0)) return std::nullopt;
    const BsdfEval e = eval(wo, s.wi);
    if (!(e.pdf > 0)) return std::nullopt;
    s.weight = e.f_cos / e.pdf;
    s.pdf = e.pdf;
    return s;
  }
};

struct CoatedDiffuse : MaterialKind {
  static constexpr bool kSmooth = true;
  Slot diffuse, specular;
  float ior = 1;  // index of refraction inside over outside
  // Weight of the coat in the choice of a lobe, which also takes account of the coat's transmittance; the
  // base has the weight 1 - specular_weight
  float specular_weight = 1;
  float internal_reflectance = 0;  // share of diffuse light from inside that the coat reflects back
  bool nonlinear = false;

  bool reads_uv() const { return any_texture(diffuse, specular); }
};

struct Plastic : CoatedDiffuse {
  static constexpr bool kHasFacets = false, mirror = true;
  static constexpr Microfacets facets{};  // never used, but SeenPlastic refers to it

  float through(float cos) const { return 1 - coat_reflectance(cos, ior); }
  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    return SeenPlastic<Plastic>(*this, look, wo).eval(wo, wi);
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    return SeenPlastic<Plastic>(*this, look, wo).sample(wo, u_lobe, u);
  }
};

struct RoughPlastic : CoatedDiffuse {
  static constexpr bool kHasFacets = true;
  // True if the coat is so smooth that it reflects like a mirror. Even then its transmittance is read from
  // tables.
  bool mirror = false;
  Microfacets facets;
  const MicrofacetEnergy* energy = nullptr;  // null unless the material has multiple_scattering
  RoughPlasticTable coat;                    // set only without multiple_scattering

  float through(float cos) const { return energy ? energy->through.at(cos) : coat.at(cos); }
  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    return SeenPlastic<RoughPlastic>(*this, look, wo).eval(wo, wi);
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    return SeenPlastic<RoughPlastic>(*this, look, wo).sample(wo, u_lobe, u);
  }
};

using PlasticKinds = Kinds<Plastic, RoughPlastic>;

template <class Description>
void set_coat_and_base(CoatedDiffuse& m, const Description& b, double eta, MaterialBuilder& builder) {
  m.nonlinear = b.nonlinear;
  m.ior = static_cast<float>(eta);
  m.diffuse = builder.reflectance(b.diffuse_reflectance);
  m.specular = builder.reflectance(b.specular_reflectance);
  if (builder.refused()) return;
  const float d = builder.mean(m.diffuse), s = builder.mean(m.specular);
  m.specular_weight = d + s > 0 ? s / (d + s) : 1;
}

inline Plastic make_material(const PlasticBsdf& b, MaterialBuilder& builder) {
  Plastic m;
  const double eta = builder.index(b.int_ior, b.ext_ior);
  set_coat_and_base(m, b, eta, builder);
  m.internal_reflectance = static_cast<float>(internal_diffuse_reflectance(eta));
  return m;
}
inline RoughPlastic make_material(const RoughPlasticBsdf& b, MaterialBuilder& builder) {
  RoughPlastic m;
  const double eta = builder.index(b.int_ior, b.ext_ior);
  const Roughness roughness = builder.roughness(b.distribution, b.alpha);
  if (builder.refused()) return m;
  m.mirror = b.alpha < kSpecularAlpha;
  m.facets = {b.distribution, roughness.u.value.x, roughness.v.value.x};
  set_coat_and_base(m, b, eta, builder);
  if (builder.refused()) return m;
  if (!b.multiple_scattering) {
    m.coat = builder.coat(b.distribution, b.alpha, eta);
    m.internal_reflectance = m.coat.internal_reflectance;
    return m;
  }
  m.energy = builder.energy(MaterialBuilder::EnergyOf::coat, b.distribution, b.alpha, eta);
  if (!m.energy) return m;
  // The share of diffuse light from inside that the coat reflects back. By reciprocity, the coat's
  // transmittance for light from inside is 1 / eta^2 of that for light from outside.
  m.internal_reflectance = static_cast<float>(1 - m.energy->through.mean() / (eta * eta));
  return m;
}

}  // namespace ls::render
