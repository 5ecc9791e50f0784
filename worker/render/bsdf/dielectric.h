// Dielectric boundaries: glass, smooth and rough, thin sheets of glass, and index-matched boundaries.
//
// A rough boundary has microfacets that reflect and refract (Walter et al. 2007), sampled by their visible
// normals (Heitz and d'Eon 2014). A sampled reflection below the surface, or a refraction above it, is
// absorbed: it would hit other microfacets, which this model leaves out.
//
// The formulas are relative to the side of wo, inside or outside: eta is the index on the other side over the
// index on wo's side. m is the microfacet's normal. V = G1(wo) / cos wo (visible_over_D() of microfacet.h),
// so D V dot(wo, m) is the density of visible normals. F is the Fresnel reflectance at m, and G the masking.
// q = dot(wo, m) + eta dot(wi, m), which is |wo + eta wi| or its negative. The formulas are:
//   density of a refracted wi: (1 - F) D V dot(wo, m) eta^2 |dot(wi, m)| / q^2
//   value f |cos wi|:          (1 - F) D G dot(wo, m) |dot(wi, m)| / (cos wo q^2)
// The value has the factor 1 / eta^2 of refracted radiance, which cancels the factor eta^2 of Walter's
// formula.
//
// A rough sheet has the lobe of a rough mirror on both sides: the transmitted directions are the reflected
// directions, mirrored at the sheet, as in Burley 2015 ("Extending the Disney BRDF to a BSDF with Integrated
// Subsurface Scattering") and KHR_materials_transmission of glTF. A facet reflects the share R, which
// includes all reflections between the two sides of the sheet, and transmits 1 - R. Both sides have the same
// index, so radiance has no factor 1 / eta^2. Let wi' be wi mirrored to the side of wo, m the normalised sum
// of wo and wi', and S = R if wi is on the side of wo, else 1 - R:
//   value f |cos wi|:          S D G / (4 cos wo)
//   density of wi:             S D pdf_over_D(wo)
#pragma once

#include "worker/render/bsdf/material_builder.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render {

struct DielectricKind : MaterialKind {
  static constexpr bool kFrontOnly = false;
  float ior = 1;  // index of refraction inside over that outside
  Slot reflectance, transmittance;

  bool reads_uv() const { return any_texture(reflectance, transmittance); }
};

struct Dielectric : DielectricKind {
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2&) const {
    if (wo.z == 0) return std::nullopt;
    const DielectricFresnel f = fresnel_dielectric(wo.z, ior);
    const float R = static_cast<float>(f.reflectance);
    if (u_lobe < R) {
      auto s = sample_mirror(look.reflectance(reflectance), wo);
      s->pdf = R;
      return s;
    }
    const float eta_ti = static_cast<float>(f.eta_ti);
    BsdfSample s;
    s.wi = ior == 1 ? -wo : normalize(V3(-eta_ti * wo.x, -eta_ti * wo.y, static_cast<float>(f.cos_t)));
    s.weight = look.reflectance(transmittance) * static_cast<float>(f.eta_ti * f.eta_ti);
    s.pdf = 1 - R;
    s.delta = true;
    s.transmitted = true;
    s.eta = static_cast<float>(f.eta_it);
    return s;
  }
};

struct ThinDielectric : DielectricKind {
  // Returns the reflectance of a thin sheet of a dielectric, including all reflections between its two
  // sides. With R the reflectance and T = 1 - R the transmittance of one side, it is
  //   R + T R T + T R^3 T + ... = 2 R / (1 + R).
  float sheet_reflectance(float cos) const {
    const double r = fresnel_dielectric(std::abs(cos), ior).reflectance;
    return static_cast<float>(2 * r / (1 + r));
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float, const V2&) const {
    return sample_mirror(look.reflectance(reflectance) * sheet_reflectance(wo.z), wo);
  }
  NullTransmission null_transmission(const Lookup& look, const V3& w) const {
    const float passes = 1 - sheet_reflectance(w.z);
    return {look.reflectance(transmittance) * passes, passes};
  }
};

struct RoughDielectric : Dielectric {
  static constexpr bool kSmooth = true;
  Roughness roughness;
  const MicrofacetEnergy* energy = nullptr;  // null unless the material has multiple_scattering

  bool reads_uv() const { return any_texture(reflectance, transmittance, roughness.u, roughness.v); }
  bool anisotropic() const { return !roughness.same_along_both(); }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    const auto rough = look.roughness(roughness);
    const bool outside = wo.z > 0;
    if (rough.mirror || wo.z == 0) return {};
    BsdfEval e = Seen(*this, look, rough.facets, outside).eval(to_side(wo, outside), to_side(wi, outside));
    if (energy) e.f_cos *= energy->factor(std::abs(wo.z), outside);
    return e;
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    if (wo.z == 0) return std::nullopt;
    const auto rough = look.roughness(roughness);
    if (rough.mirror) return Dielectric::sample(look, wo, u_lobe, u);
    const bool outside = wo.z > 0;
    auto s = Seen(*this, look, rough.facets, outside).sample(to_side(wo, outside), u_lobe, u);
    if (s) s->wi = to_side(s->wi, outside);
    if (s && energy) s->weight *= energy->factor(std::abs(wo.z), outside);
    return s;
  }

 private:
  static V3 to_side(const V3& w, bool outside) { return {w.x, w.y, outside ? w.z : -w.z}; }

  // The boundary as seen from the side of wo. Directions are mirrored, if necessary, so that wo has z > 0.
  struct Seen {
    Microfacets facets;
    C3 reflectance, transmittance;
    float eta;

    Seen(const RoughDielectric& m, const Lookup& look, const Microfacets& f, bool outside)
        : facets(f),
          reflectance(look.reflectance(m.reflectance)),
          transmittance(look.reflectance(m.transmittance)),
          eta(outside ? m.ior : 1 / m.ior) {}

    BsdfEval eval(const V3& wo, const V3& wi) const {
      const bool reflected = wi.z > 0;
      V3 h = wo + wi * (reflected ? 1.f : eta);
      if (h.z < 0) h = -h;
      const float q2 = dot(h, h);
      const V3 m = normalize(h);
      const float om = dot(wo, m), im = dot(wi, m);
      // The value is 0 if wo or wi is on the wrong side of the facet, or if wi lies in the surface plane.
      if (!(om > 0) || !(reflected ? im > 0 : im < 0) || wi.z == 0) return {};
      const auto F = static_cast<float>(fresnel_dielectric(om, eta).reflectance);
      const float D = facets.D(m), V = facets.visible_over_D(wo);
      const V3 up(wi.x, wi.y, std::abs(wi.z));
      const float G = facets.G1_over_cos(wo) * facets.G1_over_cos(up) * up.z;
      if (reflected) return {reflectance * (.25f * F * D * G), .25f * F * D * V};
      const float density = (1 - F) * D * om * -im / q2;
      return {transmittance * (density * G), density * V * eta * eta};
    }

    std::optional<BsdfSample> sample(const V3& wo, float u_lobe, const V2& u) const {
      const V3 m = facets.sample_visible(wo, u);
      const float om = dot(wo, m), D = facets.D(m), V = facets.visible_over_D(wo);
      if (!(om > 0)) return std::nullopt;
      const DielectricFresnel f = fresnel_dielectric(om, eta);
      const auto F = static_cast<float>(f.reflectance);
      const float ratio = facets.G1_over_cos(wo) / V;
      BsdfSample s;
      if (u_lobe < F) {
        s.wi = normalize(reflect(wo, m));
        if (!(s.wi.z > 0)) return std::nullopt;
        s.weight = reflectance * (ratio * facets.G1_over_cos(s.wi) * s.wi.z);
        s.pdf = .25f * F * D * V;
      } else {
        const auto eta_ti = static_cast<float>(f.eta_ti), im = static_cast<float>(f.cos_t);
        s.wi = normalize(m * (om * eta_ti + im) - wo * eta_ti);
        if (!(s.wi.z < 0)) return std::nullopt;
        const V3 up(s.wi.x, s.wi.y, -s.wi.z);
        s.weight = transmittance * (ratio * facets.G1_over_cos(up) * up.z * eta_ti * eta_ti);
        s.pdf = (1 - F) * D * V * om * sqr(eta / (om + eta * im)) * -im;
        s.transmitted = true;
        s.eta = eta;
      }
      if (!(s.pdf > 0)) return std::nullopt;
      return s;
    }
  };
};

// A thin sheet with rough sides. Where its roughness is below kSpecularAlpha it behaves as a ThinDielectric:
// transmitted light passes straight through.
struct RoughThinDielectric : ThinDielectric {
  static constexpr bool kSmooth = true;
  Roughness roughness;
  // The table that compensates for energy lost between the facets of a rough mirror; null unless the material
  // has multiple_scattering
  const MicrofacetEnergy* energy = nullptr;

  bool reads_uv() const { return any_texture(reflectance, transmittance, roughness.u, roughness.v); }
  bool anisotropic() const { return !roughness.same_along_both(); }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    const auto rough = look.roughness(roughness);
    if (rough.mirror || wo.z == 0 || wi.z == 0) return {};
    const V3 o = above(wo), in = above(wi), m = normalize(o + in);
    const Lobe lobe = lobe_at(look, dot(o, m), (wo.z > 0) == (wi.z > 0));
    const float D = rough.facets.D(m);
    const float G = rough.facets.G1_over_cos(o) * rough.facets.G1_over_cos(in) * in.z;
    BsdfEval e{lobe.tint * (lobe.share * .25f * D * G), lobe.share * D * rough.facets.pdf_over_D(o)};
    if (energy) e.f_cos *= energy->factor(o.z, true);
    return e;
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    if (wo.z == 0) return std::nullopt;
    const auto rough = look.roughness(roughness);
    if (rough.mirror) return ThinDielectric::sample(look, wo, u_lobe, u);
    const V3 o = above(wo), m = rough.facets.sample_normal(o, u);
    const float cos = dot(o, m);
    const bool reflected = u_lobe < sheet_reflectance(cos);
    const Lobe lobe = lobe_at(look, cos, reflected);
    const float pdf_over_D = rough.facets.pdf_over_D(o);
    BsdfSample s;
    s.wi = normalize(reflect(o, m));
    s.pdf = lobe.share * rough.facets.D(m) * pdf_over_D;
    if (!(s.wi.z > 0) || !(s.pdf > 0)) return std::nullopt;
    const float ratio = .25f * rough.facets.G1_over_cos(o) / pdf_over_D;
    s.weight = lobe.tint * (rough.facets.G1_over_cos(s.wi) * s.wi.z * ratio);
    if (energy) s.weight *= energy->factor(o.z, true);
    if ((wo.z > 0) != reflected) s.wi.z = -s.wi.z;
    s.transmitted = !reflected;
    return s;
  }
  NullTransmission null_transmission(const Lookup& look, const V3& w) const {
    return look.roughness(roughness).mirror ? ThinDielectric::null_transmission(look, w) : NullTransmission{};
  }

 private:
  static V3 above(const V3& w) { return {w.x, w.y, std::abs(w.z)}; }
  struct Lobe {
    float share;  // share of light that a facet at the cosine `cos` sends into the lobe
    C3 tint;
  };
  Lobe lobe_at(const Lookup& look, float cos, bool reflected) const {
    const float R = sheet_reflectance(cos);
    return {reflected ? R : 1 - R, look.reflectance(reflected ? reflectance : transmittance)};
  }
};
static_assert(kSpecularAlpha <= static_cast<float>(scene::kStraightAlpha));

// An index-matched boundary: light passes unchanged.
struct NullBoundary : MaterialKind {
  static constexpr bool kFrontOnly = false;

  static std::optional<BsdfSample> sample(const Lookup&, const V3& wo, float, const V2&) {
    BsdfSample s;
    s.wi = -wo;
    s.weight = C3(1);
    s.pdf = 1;
    s.delta = s.transmitted = true;
    return s;
  }
  static NullTransmission null_transmission(const Lookup&, const V3&) { return {C3(1), 1}; }
};

using DielectricKinds = Kinds<Dielectric, ThinDielectric, RoughDielectric, NullBoundary, RoughThinDielectric>;

template <class Description>
void set_dielectric(DielectricKind& m, const Description& b, MaterialBuilder& builder) {
  m.ior = static_cast<float>(builder.index(b.int_ior, b.ext_ior));
  m.reflectance = builder.reflectance(b.specular_reflectance);
  m.transmittance = builder.reflectance(b.specular_transmittance);
}

inline Dielectric make_material(const DielectricBsdf& b, MaterialBuilder& builder) {
  Dielectric m;
  set_dielectric(m, b, builder);
  return m;
}
inline ThinDielectric make_material(const ThinDielectricBsdf& b, MaterialBuilder& builder) {
  ThinDielectric m;
  set_dielectric(m, b, builder);
  return m;
}
inline std::variant<Dielectric, RoughDielectric> make_material(const RoughDielectricBsdf& b,
                                                               MaterialBuilder& builder) {
  RoughDielectric m;
  set_dielectric(m, b, builder);
  m.roughness = builder.roughness(b.distribution, b.alpha_u, b.alpha_v);
  // Facets of slope t deflect refracted light by about (ior - 1) t. With an ior this close to 1 the
  // deflection is invisible, but the lobe would be too narrow for float32, so the boundary is treated as
  // smooth.
  if (m.roughness.always_mirror() || std::abs(m.ior - 1) < kSpecularAlpha)
    return static_cast<const Dielectric&>(m);
  if (b.multiple_scattering)
    m.energy = builder.energy(MaterialBuilder::EnergyOf::dielectric, m.roughness,
                              builder.index(b.int_ior, b.ext_ior));
  return m;
}
inline std::variant<ThinDielectric, RoughThinDielectric> make_material(const RoughThinDielectricBsdf& b,
                                                                       MaterialBuilder& builder) {
  RoughThinDielectric m;
  set_dielectric(m, b, builder);
  m.roughness = builder.roughness(b.distribution, b.alpha_u, b.alpha_v);
  if (m.roughness.always_mirror()) return static_cast<const ThinDielectric&>(m);
  // Masking removes the same share of reflected and transmitted light, so both use the table of a rough
  // mirror.
  if (b.multiple_scattering) m.energy = builder.energy(MaterialBuilder::EnergyOf::conductor, m.roughness, 1);
  return m;
}
inline NullBoundary make_material(const NullBsdf&, MaterialBuilder&) { return {}; }

}  // namespace ls::render
