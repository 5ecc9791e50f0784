// Diffuse materials.
#pragma once

#include "worker/render/bsdf/material_builder.h"

namespace ls::render {

inline BsdfEval eval_diffuse(const C3& reflectance, const V3& wi) {
  const float p = wi.z * kInvPi;
  return {reflectance * p, p};
}

inline std::optional<BsdfSample> sample_diffuse(const C3& reflectance, const V2& u) {
  BsdfSample s;
  s.wi = cosine_hemisphere(u);
  s.weight = reflectance;
  s.pdf = s.wi.z * kInvPi;
  if (!(s.pdf > 0)) return std::nullopt;
  return s;
}

struct Diffuse : MaterialKind {  // a diffuse material with one reflectance everywhere
  static constexpr bool kSmooth = true;
  C3 reflectance;

  BsdfEval eval(const Lookup&, const V3&, const V3& wi) const { return eval_diffuse(reflectance, wi); }
  std::optional<BsdfSample> sample(const Lookup&, const V3&, float, const V2& u) const {
    return sample_diffuse(reflectance, u);
  }
};

struct TexturedDiffuse : MaterialKind {
  static constexpr bool kSmooth = true;
  Slot reflectance;

  static bool reads_uv() { return true; }
  BsdfEval eval(const Lookup& look, const V3&, const V3& wi) const {
    return eval_diffuse(look.reflectance(reflectance), wi);
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3&, float, const V2& u) const {
    return sample_diffuse(look.reflectance(reflectance), u);
  }
};

using DiffuseKinds = Kinds<Diffuse, TexturedDiffuse>;

inline std::variant<Diffuse, TexturedDiffuse> make_material(const DiffuseBsdf& b, MaterialBuilder& builder) {
  const Slot reflectance = builder.reflectance(b.reflectance);
  if (reflectance.constant) return Diffuse{{}, reflectance.value};
  return TexturedDiffuse{{}, reflectance};
}

}  // namespace ls::render
