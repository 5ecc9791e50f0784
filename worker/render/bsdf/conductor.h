// Metals, smooth and rough, bare and under a dielectric coat.
#pragma once

#include "worker/render/bsdf/material_builder.h"
#include "worker/render/bsdf/microfacet_tables.h"

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
  C3 mean_fresnel{1, 1, 1};                  // mean Fresnel reflectance; set only if `energy` is

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
  // The weight f |cos wi| / pdf is F G1(wi) times a ratio near 1, with F the Fresnel reflectance. It is
  // computed in this form because the density D of the normals, which may be huge or inaccurate, cancels.
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

template <class Kind, class Description>
Kind metal_of(const Description& b, MaterialBuilder& builder) {
  Kind m;
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
  return m;
}

inline Conductor make_material(const ConductorBsdf& b, MaterialBuilder& builder) {
  return metal_of<Conductor>(b, builder);
}
inline std::variant<Conductor, RoughConductor> make_material(const RoughConductorBsdf& b,
                                                             MaterialBuilder& builder) {
  auto m = metal_of<RoughConductor>(b, builder);
  m.roughness = builder.roughness(b.distribution, b.alpha_u, b.alpha_v);
  if (m.roughness.always_mirror()) return static_cast<const Conductor&>(m);
  if (b.multiple_scattering) {
    m.energy = builder.energy(MaterialBuilder::EnergyOf::conductor, m.roughness, 1);
    m.mean_fresnel = mean_fresnel(m.eta, m.k);
  }
  return m;
}

// Metals under a dielectric coat that absorbs nothing. Coat and metal are each smooth or have GGX facets.
//
// Let F be the coat's reflectance for light from outside and T = 1 - F its transmittance. Let R be the
// metal's reflectance at the refracted angle, for an index relative to the coat's. By reciprocity the coat
// also reflects the share F of light that meets it from inside at the refracted angle. If coat and metal are
// smooth, the sum over all inner reflections is exact:
//
//   R_all = F + T R T + T R F R T + ... = F + T^2 R / (1 - F R).
//
// Otherwise the value of the BSDF has three parts (docs/design/coated-metal.md gives their errors). The
// suffixes _o and _i mean "for the direction wo" and "for the direction wi".
//
//   coat     The reflection of the coat: F D G / (4 cos cos), or a delta if the coat is smooth.
//   metal    T_o T_i / n^2 times the value of the metal's facets between the two refracted directions, times
//            the series 1 / (1 - min(F_o, F_i) R). n is the coat's index, and 1 / n^2 is the ratio of the
//            projected solid angles inside and outside. Under a smooth coat the first term of the series is
//            exact. A rough coat refracts directions as a plane does, but (n - 1)^2 / (2 n^2) times its
//            squared roughness is added to the metal's: two refractions add this to the variance of the
//            slope, in the limit of small slopes.
//   rest     Light that the metal reflects beyond the cone of refraction, or that the series above leaves
//            out. It stays in the coat at first, and leaves it after more reflections as
//            Q(wo) Q(wi) / (pi Q_mean), where Q(w) is the share of the light from w that stays. This form is
//            reciprocal and returns the energy Q (Kulla and Conty 2017).
//
// For a white metal the three parts sum to 1 minus the light that single scattering between the metal's
// facets loses; a roughconductor loses as much. T, F and Q are tables over the cosine.
//
// A smooth metal under a smooth coat. The metal's index is relative to that of the coat.
struct CoatedConductor : Conductor {
  float ior = 1;  // index of the coat over the index outside

  C3 reflectance(const Metal& metal, float cos) const {
    const DielectricFresnel f = fresnel_dielectric(cos, ior);
    const auto F = static_cast<float>(f.reflectance), T = 1 - F;
    if (!(T > 0)) return C3(1);
    const C3 R = metal.reflectance(static_cast<float>(-f.cos_t));
    // T + F (1 - R) is 1 - F R without the cancellation that leaves 0 where F and R are near 1
    return C3(F) + R * (T * T) / (C3(T) + (C3(1) - R) * F);
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float, const V2&) const {
    return sample_mirror(reflectance(metal(look), wo.z), wo);
  }
};

struct RoughCoatedConductor : CoatedConductor {
  static constexpr bool kSmooth = true;
  bool coat_is_smooth = true;
  // The facets of the coat and of the metal (`base`). The metal's roughness includes what the two refractions
  // at a rough coat add (see above).
  Microfacets coat, base;
  CoatedConductorTables tables;
  C3 mean_fresnel{1, 1, 1};  // mean Fresnel reflectance of the metal without its tint

  bool anisotropic() const { return base.ax != base.ay; }
  struct Shares {
    float through, reflected;
  };
  Shares shares(float cos) const {
    if (!coat_is_smooth) return {tables.through.at(cos), tables.reflected.at(cos)};
    const auto F = static_cast<float>(fresnel_dielectric(cos, ior).reflectance);
    return {1 - F, F};
  }
  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const;
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const;
};

using CoatedConductorKinds = Kinds<CoatedConductor, RoughCoatedConductor>;

std::variant<Conductor, RoughConductor, CoatedConductor, RoughCoatedConductor> make_material(
    const CoatedConductorBsdf& b, MaterialBuilder& builder);

}  // namespace ls::render
