// Metals under a dielectric coat that absorbs nothing. Coat and metal are each smooth or have GGX facets.
//
// Let F be the coat's reflectance for light from outside and T = 1 - F its transmittance. Let R be the
// metal's reflectance at the refracted angle, for an index relative to the coat's. By reciprocity the coat
// also reflects the share F of light that meets it from inside at the refracted angle. If coat and metal are
// smooth, the sum over all inner reflections is exact:
//
//   R_all = F + T R T + T R F R T + ... = F + T^2 R / (1 - F R).
//
// Otherwise the value has three parts (docs/design/coated-metal.md gives their errors):
//
//   coat     The reflection of the coat: F D G / (4 cos cos), or a delta if the coat is smooth.
//   metal    T_o T_i / n^2 times the value of the metal's facets between the two refracted directions, times
//            the series 1 / (1 - (1 - T) R) with T = max(T_o, T_i). n is the coat's index, and 1 / n^2 is the
//            ratio of the projected solid angles inside and outside. Under a smooth coat the first term of
//            the series is exact. A rough coat refracts directions as a plane does, but (n - 1)^2 / (2 n^2)
//            times its squared roughness is added to the metal's: two refractions add this to the variance of
//            the slope, in the limit of small slopes.
//   rest     Light that the metal reflects beyond the cone of refraction, or that the series above leaves
//            out. It stays in the coat at first, and leaves it after more reflections as
//            Q(wo) Q(wi) / (pi Q_mean), where Q(w) is the share of the light from w that stays. This form is
//            reciprocal and returns the energy Q (Kulla and Conty 2017).
//
// For a white metal the three parts sum to 1 minus the light that single scattering between the metal's
// facets loses; a roughconductor loses as much. T and Q are tabulated over the cosine.
#pragma once

#include "worker/render/bsdf/conductor.h"

namespace ls::render {

// A smooth metal under a smooth coat. The metal's index is relative to that of the coat.
struct CoatedConductor : Conductor {
  float ior = 1;  // of the coat, over that outside

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
  // The base is the metal; its roughness includes what the refractions of a rough coat add.
  Microfacets coat, base;
  CoatedConductorTables tables;
  C3 mean_fresnel{1, 1, 1};  // the metal's, without its tint

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
