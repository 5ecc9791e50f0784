// Materials that consist of other materials, their parts: two-sided, mask, blend, normal map and bump map.
// Their functions call the functions of the parts through the BsdfTable, which holds all materials of a
// scene. Materials are nested at most scene::kMaxBsdfNesting levels deep (checked by BsdfTable::build).
#pragma once

#include "worker/render/bsdf/material_builder.h"

namespace ls::render {

// Samples the scattering of the material `part`. Returns nullopt if it is null, that is, index-matched, and
// so scatters nothing.
inline std::optional<BsdfSample> sample_part(const Lookup& look, BsdfIndex part, const UvPoint& uv,
                                             const V3& wo, float u_lobe, const V2& u) {
  if (look.table.is_null(part)) return std::nullopt;
  return look.table.sample(part, uv, wo, u_lobe, u);
}

// A material with one part for each side of the surface. BsdfTable replaces it by the part of the side that
// is seen before it calls eval() or sample(), so TwoSided::eval() and TwoSided::sample() are never called.
// The parts are not two-sided themselves.
struct TwoSided : MaterialKind {
  BsdfIndex front, back;

  std::array<BsdfIndex, 2> parts() const { return {front, back}; }
  static std::optional<BsdfSample> sample(const Lookup&, const V3&, float, const V2&) { return std::nullopt; }
};

struct Mask : MaterialKind {
  static constexpr bool kFrontOnly = false;
  Slot opacity;
  BsdfIndex part;

  std::array<BsdfIndex, 1> parts() const { return {part}; }
  bool reads_uv() const { return any_texture(opacity); }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    BsdfEval e = look.table.eval(part, look.at, wo, wi);
    e.f_cos *= look.share(opacity);
    return e;
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    auto s = sample_part(look, part, look.at, wo, u_lobe, u);
    if (s) s->weight *= look.share(opacity);
    return s;
  }
  NullTransmission null_transmission(const Lookup& look, const V3& w) const {
    const float share = look.share(opacity);
    const NullTransmission inner = look.table.null_transmission(part, look.at, w);
    return {C3(1) - (C3(1) - inner.transmission) * share, 1 - (1 - inner.probability) * share};
  }
};

struct Blend : MaterialKind {
  static constexpr bool kFrontOnly = false;
  Slot weight;  // weight of the second part, from 0 to 1
  BsdfIndex part[2];
  bool passes = false;  // true if light passes straight through a part (null transmission)

  std::array<BsdfIndex, 2> parts() const { return {part[0], part[1]}; }
  bool reads_uv() const { return any_texture(weight); }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    const Mixture x = mixture(look, wo);
    const BsdfEval a = look.table.eval(part[0], look.at, wo, wi),
                   b = look.table.eval(part[1], look.at, wo, wi);
    return {a.f_cos * x.share[0] + b.f_cos * x.share[1], a.pdf * x.chance[0] + b.pdf * x.chance[1]};
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    const Mixture x = mixture(look, wo);
    const int k = u_lobe < x.chance[1];
    const float rest = k ? u_lobe / x.chance[1] : (u_lobe - x.chance[1]) / x.chance[0];
    auto s = sample_part(look, part[k], look.at, wo, std::min(rest, kBelowOne), u);
    if (!s) return s;
    // If the other material contributes nothing, the result is that of this material alone, bit for bit.
    if (x.share[1 - k] == 0 && x.chance[1 - k] == 0) return s;
    if (s->delta) {
      s->weight *= x.share[k] / x.chance[k];
      s->pdf *= x.chance[k];
      return s;
    }
    const BsdfEval other = look.table.eval(part[1 - k], look.at, wo, s->wi);
    const float pdf = x.chance[k] * s->pdf + x.chance[1 - k] * other.pdf;
    s->weight = (s->weight * (x.share[k] * s->pdf) + other.f_cos * x.share[1 - k]) / pdf;
    s->pdf = pdf;
    return s;
  }
  NullTransmission null_transmission(const Lookup& look, const V3& w) const {
    if (!passes) return {};
    const float share = look.share(weight);
    const NullTransmission a = look.table.null_transmission(part[0], look.at, w),
                           b = look.table.null_transmission(part[1], look.at, w);
    return {a.transmission * (1 - share) + b.transmission * share,
            a.probability * (1 - share) + b.probability * share};
  }

 private:
  // The blend as seen from wo. `share` is the weight of each part in the mixture, and `chance` the
  // probability of sampling it (0 for an index-matched material, which scatters nothing).
  struct Mixture {
    float share[2], chance[2];
  };
  Mixture mixture(const Lookup& look, const V3& wo) const {
    const float w = look.share(weight);
    Mixture x{{1 - w, w}, {1 - w, w}};
    if (!passes) return x;
    x.chance[0] *= 1 - look.table.null_transmission(part[0], look.at, wo).probability;
    x.chance[1] *= 1 - look.table.null_transmission(part[1], look.at, wo).probability;
    const float sum = x.chance[0] + x.chance[1];
    if (sum > 0) x.chance[1] = std::min(1.f, x.chance[1] / sum);
    x.chance[0] = 1 - x.chance[1];
    return x;
  }
};

// Normal and bump maps: the nested material is evaluated in a frame that the map rotates. Map::normal gives
// the mapped normal in the surface's own frame, of any length.
template <class Map>
struct Mapped : MaterialKind {
  static constexpr bool kFrontOnly = false;
  Slot map;
  BsdfIndex part;
  bool passes = false;   // true if light passes straight through the nested material
  bool flips = false;    // the scene's parameter flip_invalid_normals, used by frame()
  bool shadows = false;  // the scene's parameter use_shadowing_function, used by shadow()

  std::array<BsdfIndex, 1> parts() const { return {part}; }
  bool reads_uv() const { return any_texture(map); }
  static bool anisotropic() { return true; }

  BsdfEval eval(const Lookup& look, const V3& wo, const V3& wi) const {
    const Frame turned = frame(look, wo);
    const V3 o = turned.to_local(wo), in = turned.to_local(wi);
    if (!same_side(o, wo) || !same_side(in, wi)) return {};
    BsdfEval e = look.table.eval(part, look.at.seen_in(turned), o, in);
    e.f_cos *= shadow(turned.n, wi);
    return e;
  }
  std::optional<BsdfSample> sample(const Lookup& look, const V3& wo, float u_lobe, const V2& u) const {
    const Frame turned = frame(look, wo);
    const V3 o = turned.to_local(wo);
    if (!same_side(o, wo)) return std::nullopt;
    auto s = sample_part(look, part, look.at.seen_in(turned), o, u_lobe, u);
    if (!s) return s;
    const V3 w = normalize(turned.to_world(s->wi));
    if (!same_side(w, s->wi)) return std::nullopt;
    s->wi = w;
    s->weight *= shadow(turned.n, w);
    return s;
  }
  NullTransmission null_transmission(const Lookup& look, const V3& w) const {
    if (!passes) return {};
    const Frame turned = frame(look, w);
    const V3 in = turned.to_local(w);
    if (!same_side(in, w)) return {};
    NullTransmission v = look.table.null_transmission(part, look.at.seen_in(turned), in);
    v.transmission *= shadow(turned.n, w);  // the map also shadows light that passes straight through
    return v;
  }

 private:
  // Returns the frame in which the nested material is evaluated, relative to the surface's own frame. Its
  // tangent s is as close to the surface's as the mapped normal allows. With flip_invalid_normals a mapped
  // normal that faces away from the viewer is rotated by half a turn about the surface's normal (Schuessler
  // et al. 2017).
  Frame frame(const Lookup& look, const V3& wo) const {
    V3 n = static_cast<const Map&>(*this).normal(look);
    if (flips && wo.z * dot(wo, n) <= 0) n = {-n.x, -n.y, n.z};
    const float l2 = dot(n, n);
    return l2 > 0 && std::isfinite(l2) ? Frame::from_tangent(n * (1 / std::sqrt(l2)), V3(1, 0, 0)) : Frame();
  }
  // The share of the light from wi that is not shadowed. The shadowing is that of rough facets whose typical
  // slope is the slope of the map's normal n (Estevez, Lecocq, Stein 2019).
  float shadow(const V3& n, const V3& wi) const {
    if (!shadows) return 1;
    const float a2 = std::min(.125f * (n.x * n.x + n.y * n.y) / (n.z * n.z), 1.f);
    return a2 > 0 ? 2 / (1 + std::sqrt(1 + a2 * (wi.x * wi.x + wi.y * wi.y) / (wi.z * wi.z))) : 1;
  }
  // True if a direction is on the same side of the surface in two frames; a and b are the direction's
  // components in the first and in the second frame. Callers return zero for directions that are on different
  // sides, since light would leak through the surface along them.
  static bool same_side(const V3& a, const V3& b) { return a.z * b.z > 0; }
};

struct NormalMap : Mapped<NormalMap> {
  bool follows_mirroring = false;

  bool reads_slopes() const { return follows_mirroring; }
  V3 normal(const Lookup& look) const {
    V3 n = look.reflectance(map) * 2 - V3(1);
    // v points down the image. So where the image is not mirrored, (dp/du, dp/dv, normal) are left-handed.
    const UvPoint& at = look.at;
    if (follows_mirroring && at.du.x * at.dv.y - at.du.y * at.dv.x > 0) n.y = -n.y;
    return n;
  }
};

struct BumpMap : Mapped<BumpMap> {
  float scale = 1;

  static bool reads_slopes() { return true; }

  // A bump map displaces the surface by h along its normal n. This changes the components of dp/du and dp/dv
  // along n from 0 to dh/du and dh/dv (Blinn 1978; the change of n itself is neglected).
  V3 normal(const Lookup& look) const {
    if (map.constant) return {0, 0, 1};
    const UvPoint& at = look.at;
    const V2 slope = look.textures.slope(map.texture, at.uv) * scale;
    const V3 n = cross({at.du.x, at.du.y, slope.x}, {at.dv.x, at.dv.y, slope.y});
    if (n.z == 0) return {0, 0, 1};  // dp/du and dp/dv are parallel or zero
    return n.z < 0 ? -n : n;         // the sign depends on the handedness of (u, v)
  }
};

using NestedKinds = Kinds<TwoSided, Mask, Blend, NormalMap, BumpMap>;

inline TwoSided make_material(const TwoSidedBsdf& b, MaterialBuilder& builder) {
  return {{}, builder.side(b.front), builder.side(b.back)};
}
inline Mask make_material(const MaskBsdf& b, MaterialBuilder& builder) {
  return {{}, builder.reflectance(b.opacity), b.bsdf};
}
inline Blend make_material(const BlendBsdf& b, MaterialBuilder& builder) {
  Blend m;
  m.weight = builder.reflectance(b.weight);
  m.part[0] = b.first;
  m.part[1] = b.second;
  m.passes = builder.passes(b.first) || builder.passes(b.second);
  return m;
}
template <class Map, class Description>
Map map_of(const Description& b, TextureIndex texture, MaterialBuilder& builder) {
  Map m;
  m.map = builder.slot(texture);
  m.part = b.bsdf;
  m.passes = builder.passes(b.bsdf);
  m.flips = b.flip_invalid_normals;
  m.shadows = b.use_shadowing_function;
  return m;
}
inline NormalMap make_material(const NormalMapBsdf& b, MaterialBuilder& builder) {
  auto m = map_of<NormalMap>(b, b.normalmap, builder);
  m.follows_mirroring = b.follow_mirroring;
  return m;
}
inline BumpMap make_material(const BumpMapBsdf& b, MaterialBuilder& builder) {
  auto m = map_of<BumpMap>(b, b.texture, builder);
  m.scale = static_cast<float>(b.scale);
  if (!std::isfinite(m.scale)) builder.refuse(fmt::format("a bump map's scale is {}", b.scale));
  return m;
}

}  // namespace ls::render
