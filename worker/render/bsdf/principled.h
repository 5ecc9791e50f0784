// Burley's principled material ("Physically Based Shading at Disney", 2012; "Extending the Disney BRDF to a
// BSDF with Integrated Subsurface Scattering", 2015) with the parameters and formulas of Mitsuba 3's plugin
// `principled`. It has four lobes: diffuse (with retro-reflection, sheen and an approximation of subsurface
// scattering), a clear coat (GTR1), and GGX facets that reflect and, with spec_trans, refract.
//
// Sampling: a lobe is chosen from the parameters at wo; for the facets, first a visible normal and then, by
// its Fresnel reflectance F, reflection or refraction. With m metallic, t spec_trans and b = (1 - m) t the
// unnormalised probabilities are, from the front, 1 for the facets (of which 1 - b (1 - F) reflect), 1/4 of
// the parameter clearcoat for the coat, and (1 - m) (1 - t) for the diffuse lobe; from behind there are only
// the facets, of which F reflect.
#pragma once

#include "worker/render/bsdf/material_builder.h"

namespace ls::render {

struct Principled : MaterialKind {
  static constexpr bool kFrontOnly = false;
  static constexpr bool kSmooth = true;
  Slot base_color, roughness, anisotropic_slot, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness,
      clearcoat, clearcoat_gloss;
  bool transmits = false;
  float eta = 1.5f;  // index of refraction inside over outside

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
