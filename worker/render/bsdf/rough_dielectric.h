// A rough boundary between two dielectrics: microfacets that reflect and refract (Walter et al. 2007),
// sampled by their visible normals (Heitz and d'Eon 2014). A sampled reflection below the surface, or a
// refraction above it, is absorbed: it would meet other microfacets, which this model leaves out.
//
// All formulas are as seen from the side that wo is on, inside or outside: eta is the index on the other side
// over the index on wo's side. With m the microfacet's normal, V = visible_over_D(wo) and q = dot(wo, m) +
// eta dot(wi, m) = +-|wo + eta wi|:
//   density of a refracted wi: (1 - F) D V dot(wo, m) eta^2 |dot(wi, m)| / q^2
//   value f |cos wi|:          (1 - F) D G dot(wo, m) |dot(wi, m)| / (cos wo q^2)
// where 1 / eta^2, for radiance, cancels the eta^2 of the value.
#pragma once

#include "worker/render/bsdf/lobes.h"

namespace ls::render {

struct RoughDielectric {
  Microfacets facets;
  C3 reflectance, transmittance;
  float eta;

  RoughDielectric(const BsdfTable::Material& m, const Lookup& look, const Microfacets& f, bool outside)
      : facets(f),
        reflectance(look.reflectance(m.specular_slot)),
        transmittance(look.reflectance(m.second_slot)),
        eta(outside ? m.ior : 1 / m.ior) {}

  // Requires wo above the surface; wi may be on either side.
  BsdfEval eval(const V3& wo, const V3& wi) const {
    const bool reflected = wi.z > 0;
    V3 h = wo + wi * (reflected ? 1.f : eta);
    if (h.z < 0) h = -h;
    const float q2 = dot(h, h);
    const V3 m = normalize(h);
    const float om = dot(wo, m), im = dot(wi, m);
    // The facet is seen from behind by wo or wi, or wi lies in the surface plane.
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

}  // namespace ls::render
