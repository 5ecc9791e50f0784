// Helpers shared by the lobes of several material kinds.
#pragma once

#include <algorithm>

#include "worker/render/base/built.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/material.h"

namespace ls::render {

struct Lookup {
  const TextureTable& textures;
  V2 uv;  // of the surface
  const FacePoint* face;

  Lookup(const TextureTable& table, const UvPoint& at) : textures(table), uv(at.uv), face(at.face) {}
  C3 reflectance(const Slot& s) const {
    if (!kBuilt.textures || s.constant) return s.value;
    const C3 c = textures.eval(s.texture, uv, face);
    return {std::clamp(c.x, 0.f, 1.f), std::clamp(c.y, 0.f, 1.f), std::clamp(c.z, 0.f, 1.f)};
  }
  float scalar(const Slot& s) const {
    if (kBuilt.textures && !s.constant) return textures.number(s.texture, uv, face);
    const C3& c = s.value;
    return c.x == c.y && c.y == c.z ? c.x : luminance(c);
  }
  float share(const Slot& s) const { return std::clamp(scalar(s), 0.f, 1.f); }
  struct Roughness {
    Microfacets facets;
    bool mirror;
  };
  Roughness roughness(const BsdfTable::Material& m) const {
    const float u = scalar(m.alpha_u), v = scalar(m.alpha_v);
    return {{m.distribution, std::max(u, kMinAlpha), std::max(v, kMinAlpha)},
            u < kSpecularAlpha && v < kSpecularAlpha};
  }
};

inline V3 mirrored(const V3& w) { return {-w.x, -w.y, w.z}; }

inline std::optional<BsdfSample> sample_mirror(const C3& weight, const V3& wo) {
  BsdfSample s;
  s.wi = mirrored(wo);
  s.weight = weight;
  s.pdf = 1;
  s.delta = true;
  return s;
}

inline std::optional<BsdfSample> sample_dielectric(const BsdfTable::Material& m, const Lookup& look,
                                                   const V3& wo, float u_lobe) {
  const DielectricFresnel f = fresnel_dielectric(wo.z, m.ior);
  const float R = static_cast<float>(f.reflectance);
  if (u_lobe < R) {
    auto s = sample_mirror(look.reflectance(m.specular_slot), wo);
    s->pdf = R;
    return s;
  }
  const float eta_ti = static_cast<float>(f.eta_ti);
  BsdfSample s;
  s.wi = m.ior == 1 ? -wo : normalize(V3(-eta_ti * wo.x, -eta_ti * wo.y, static_cast<float>(f.cos_t)));
  s.weight = look.reflectance(m.second_slot) * static_cast<float>(f.eta_ti * f.eta_ti);
  s.pdf = 1 - R;
  s.delta = true;
  s.transmitted = true;
  s.eta = static_cast<float>(f.eta_it);
  return s;
}

}  // namespace ls::render
