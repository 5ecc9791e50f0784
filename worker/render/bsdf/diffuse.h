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
  static constexpr bool kSmooth = true, kDiffuse = true;
  C3 reflectance;

  BsdfEval eval(const Lookup&, const V3&, const V3& wi) const { return eval_diffuse(reflectance, wi); }
  std::optional<BsdfSample> sample(const Lookup&, const V3&, float, const V2& u) const {
    return sample_diffuse(reflectance, u);
  }
};

struct TexturedDiffuse : MaterialKind {
  static constexpr bool kSmooth = true, kDiffuse = true;
  Slot reflectance;

  static bool reads_uv() { return true; }
  BsdfEval eval(const Lookup& look, const V3&, const V3& wi) const {
    return eval_diffuse(look.reflectance(reflectance), wi);
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3&, float, const V2& u) const {
    return sample_diffuse(look.reflectance(reflectance), u);
  }
};

// A sheet that scatters light ideally on both sides: f = reflectance / pi on the side of wo, and
// transmittance / pi on the other.
struct DiffuseTransmission : MaterialKind {
  static constexpr bool kFrontOnly = false, kSmooth = true, kDiffuse = true;
  Slot reflectance, transmittance;

  bool reads_uv() const { return any_texture(reflectance, transmittance); }
  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    if (wo.z == 0 || wi.z == 0) return {};
    const bool reflected = (wo.z > 0) == (wi.z > 0);
    const Sides s(*this, look);
    const float p = std::abs(wi.z) * kInvPi;
    return {s.share[reflected] * p, s.chance[reflected] * p};
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    if (wo.z == 0) return std::nullopt;
    const Sides sides(*this, look);
    const bool reflected = u_lobe < sides.chance[true];
    BsdfSample s;
    s.wi = cosine_hemisphere(u);
    s.pdf = sides.chance[reflected] * s.wi.z * kInvPi;
    if (!(s.pdf > 0)) return std::nullopt;
    s.weight = sides.share[reflected] * (1 / sides.chance[reflected]);
    if ((wo.z > 0) != reflected) s.wi.z = -s.wi.z;
    s.transmitted = !reflected;
    return s;
  }

 private:
  // The two lobes at one point: index 1 (true) is reflection, index 0 is transmission. `share` is the albedo
  // of the lobe, and `chance` the probability of sampling it. Where the textures add up to more than 1, the
  // shares are divided by the sum.
  struct Sides {
    C3 share[2];
    float chance[2];

    Sides(const DiffuseTransmission& m, const Lookup& look)
        : share{look.reflectance(m.transmittance), look.reflectance(m.reflectance)} {
      for (int c = 0; c < 3; ++c) {
        const float sum = share[0][c] + share[1][c];
        if (sum > 1) share[0][c] /= sum, share[1][c] /= sum;
      }
      const float through = max_component(share[0]), back = max_component(share[1]), both = through + back;
      chance[0] = both > 0 ? through / both : 0;
      chance[1] = both > 0 ? back / both : 0;
    }
  };
};

using DiffuseKinds = Kinds<Diffuse, TexturedDiffuse, DiffuseTransmission>;

inline std::variant<Diffuse, TexturedDiffuse> make_material(const DiffuseBsdf& b, MaterialBuilder& builder) {
  const Slot reflectance = builder.reflectance(b.reflectance);
  if (reflectance.constant) return Diffuse{{}, reflectance.value};
  return TexturedDiffuse{{}, reflectance};
}
inline DiffuseTransmission make_material(const DiffuseTransmissionBsdf& b, MaterialBuilder& builder) {
  return {{}, builder.reflectance(b.reflectance), builder.reflectance(b.transmittance)};
}

}  // namespace ls::render
