// Burley's principled material ("Physically Based Shading at Disney", 2012; "Extending the Disney BRDF to a
// BSDF with Integrated Subsurface Scattering", 2015) with the parameters and formulas of Mitsuba 3's plugin
// `principled`. It has four lobes: diffuse (with retro-reflection, sheen and an approximation of subsurface
// scattering), a clear coat (GTR1), and GGX facets that reflect and, with spec_trans, refract.
//
// Sampling: sample() first chooses a lobe from the parameters at wo. For the facets it then samples a visible
// normal and chooses reflection or refraction by the Fresnel reflectance F of that normal. With m = metallic,
// t = spec_trans and b = (1 - m) t, the unnormalised probabilities from the front are 1 for the facets (they
// reflect with probability 1 - b (1 - F)), clearcoat / 4 for the coat, and (1 - m) (1 - t) for the diffuse
// lobe. From behind there are only the facets, which reflect with probability F.
//
// With multiple_scattering (our own) each part of what the facets reflect or refract is multiplied by the
// factor that docs/design/multiple-scattering.md gives for its kind: that of a metal of its own mean
// reflectance for what metal and opaque dielectric reflect, and that of a dielectric for glass. Diffuse lobe
// and coat stay as they are: they lose nothing between facets. Sampling stays as it is.
#pragma once

#include "worker/render/bsdf/material_builder.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render {

struct Principled : MaterialKind {
  static constexpr bool kFrontOnly = false;
  static constexpr bool kSmooth = true;
  Slot base_color, roughness, anisotropic_slot, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness,
      clearcoat, clearcoat_gloss;
  bool transmits = false;
  float eta = 1.5f;  // index of refraction inside over outside
  // What compensates for light lost between the facets (microfacet_tables.h): of those that reflect, and of
  // those of glass (empty unless `transmits`). Both are empty without multiple_scattering.
  EnergyByRoughness metal_energy, glass_energy;
  float mean_fresnel = 0;  // of the dielectric, seen from the front; set only with multiple_scattering

  bool reads_uv() const {
    return any_texture(base_color, roughness, anisotropic_slot, metallic, spec_trans, spec_tint, sheen,
                       sheen_tint, flatness, clearcoat, clearcoat_gloss);
  }
  bool anisotropic() const { return !anisotropic_slot.constant || anisotropic_slot.value.x > 0; }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const;
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const;
};

using PrincipledKinds = Kinds<Principled>;

Principled make_material(const PrincipledBsdf& b, MaterialBuilder& builder);

}  // namespace ls::render
