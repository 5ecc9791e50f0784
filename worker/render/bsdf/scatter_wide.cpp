// The material kinds that scatter to both sides of the surface, let light pass, or consist of other
// materials. For the last of these the functions call each other recursively, at most scene::kMaxBsdfNesting
// deep (checked by build()).
#include "worker/render/base/work_counters.h"
#include "worker/render/bsdf/lobes.h"
#include "worker/render/bsdf/principled.h"
#include "worker/render/bsdf/rough_dielectric.h"

namespace ls::render {

namespace {

using Material = BsdfTable::Material;

// The reflectance of a thin sheet of a dielectric, with all reflections between its two sides, where R is the
// reflectance and T the transmittance of one side: R + T R T + T R^3 T + ... = 2 R / (1 + R).
float sheet_reflectance(float cos, float ior) {
  const double r = fresnel_dielectric(std::abs(cos), ior).reflectance;
  return static_cast<float>(2 * r / (1 + r));
}

// The normal of a normal or bump map in the surface's own frame, of any length. A bump map lifts the surface
// by h along its normal n, which changes only the components along n of dp/du and dp/dv, to dh/du and dh/dv
// (Blinn 1978, without the change of n itself).
V3 mapped_normal(const Material& m, const Lookup& look, const UvPoint& at) {
  if (m.kind == MaterialKind::normal_map) return look.reflectance(m.specular_slot) * 2 - V3(1);
  if (m.specular_slot.constant) return {0, 0, 1};
  const V2 slope = look.textures.slope(m.specular_slot.texture, at.uv) * m.specular_weight;
  const V3 n = cross({at.du.x, at.du.y, slope.x}, {at.dv.x, at.dv.y, slope.y});
  if (n.z == 0) return {0, 0, 1};  // dp/du and dp/dv are parallel or zero here
  return n.z < 0 ? -n : n;         // (u, v) may have either handedness
}
// The frame in which the nested material is evaluated, in the surface's own frame. Its s is as near to the
// surface's as the mapped normal allows. With flip_invalid_normals a mapped normal that faces away from the
// viewer is rotated by half a turn about the surface's normal (Schuessler et al. 2017).
Frame mapped_frame(const Material& m, const Lookup& look, const UvPoint& at, const V3& wo) {
  V3 n = mapped_normal(m, look, at);
  if (m.flips && wo.z * dot(wo, n) <= 0) n = {-n.x, -n.y, n.z};
  const float l2 = dot(n, n);
  return l2 > 0 && std::isfinite(l2) ? Frame::from_tangent(n * (1 / std::sqrt(l2)), V3(1, 0, 0)) : Frame();
}
// The shadowing factor for light from wi, by facets that have the slope of the map's normal n (Estevez,
// Lecocq, Stein 2019).
float mapped_shadow(const Material& m, const V3& n, const V3& wi) {
  if (!m.shadows) return 1;
  const float a2 = std::min(.125f * (n.x * n.x + n.y * n.y) / (n.z * n.z), 1.f);
  return a2 > 0 ? 2 / (1 + std::sqrt(1 + a2 * (wi.x * wi.x + wi.y * wi.y) / (wi.z * wi.z))) : 1;
}
// True if a and b, one direction in two frames, is on the same side of the surface in both. Otherwise light
// would pass through the surface.
bool same_side(const V3& a, const V3& b) { return a.z * b.z > 0; }

V3 to_side(const V3& w, bool outside) { return {w.x, w.y, outside ? w.z : -w.z}; }

}  // namespace

// A blend of two materials seen from wo. `share` is the weight of each of them in the mixture, and `chance`
// the probability of sampling it (a null material is never sampled).
struct BsdfTable::Mixture {
  float share[2], chance[2];
};

BsdfTable::Mixture BsdfTable::mixture(const Material& m, const UvPoint& uv, const V3& wo) const {
  const float w = Lookup{*textures_, uv}.share(m.specular_slot);
  Mixture x{{1 - w, w}, {1 - w, w}};
  if (!m.null_transmission) return x;
  x.chance[0] *= 1 - null_transmission({m.front}, uv, wo).probability;
  x.chance[1] *= 1 - null_transmission({m.back}, uv, wo).probability;
  const float sum = x.chance[0] + x.chance[1];
  if (sum > 0) x.chance[1] = std::min(1.f, x.chance[1] / sum);
  x.chance[0] = 1 - x.chance[1];
  return x;
}

NullTransmission BsdfTable::null_transmission(BsdfIndex i, const UvPoint& uv, const V3& w) const {
  LS_COUNT(null_transmission);
  const Material& m = materials_[i.value];
  const Lookup look{*textures_, uv};
  switch (m.kind) {
    case MaterialKind::null:
      return {C3(1), 1};
    case MaterialKind::thin_dielectric: {
      const float passes = 1 - sheet_reflectance(w.z, m.ior);
      return {look.reflectance(m.second_slot) * passes, passes};
    }
    case MaterialKind::mask: {
      const float opacity = look.share(m.specular_slot);
      const NullTransmission inner = null_transmission({m.front}, uv, w);
      return {C3(1) - (C3(1) - inner.transmission) * opacity, 1 - (1 - inner.probability) * opacity};
    }
    case MaterialKind::blend: {
      if (!m.null_transmission) return {};
      const float weight = look.share(m.specular_slot);
      const NullTransmission a = null_transmission({m.front}, uv, w), b = null_transmission({m.back}, uv, w);
      return {a.transmission * (1 - weight) + b.transmission * weight,
              a.probability * (1 - weight) + b.probability * weight};
    }
    case MaterialKind::normal_map:
    case MaterialKind::bump_map: {
      if (!m.null_transmission) return {};
      const Frame frame = mapped_frame(m, look, uv, w);
      const V3 in = frame.to_local(w);
      if (!same_side(in, w)) return {};
      NullTransmission v = null_transmission({m.front}, uv.seen_in(frame), in);
      v.transmission *= mapped_shadow(m, frame.n, w);  // the map shadows this light too
      return v;
    }
    default:
      return {};
  }
}

BsdfEval BsdfTable::eval_wide(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const {
  const Lookup look{*textures_, uv};
  switch (m.kind) {
    case MaterialKind::rough_dielectric: {
      const auto rough = look.roughness(m);
      const bool outside = wo.z > 0;
      if (rough.mirror || wo.z == 0) return {};
      BsdfEval e =
          RoughDielectric(m, look, rough.facets, outside).eval(to_side(wo, outside), to_side(wi, outside));
      if (m.energy) e.f_cos *= m.energy->factor(std::abs(wo.z), outside);
      return e;
    }
    case MaterialKind::mask: {
      BsdfEval e = eval({m.front}, uv, wo, wi);
      e.f_cos *= look.share(m.specular_slot);
      return e;
    }
    case MaterialKind::blend: {
      const Mixture x = mixture(m, uv, wo);
      const BsdfEval a = eval({m.front}, uv, wo, wi), b = eval({m.back}, uv, wo, wi);
      return {a.f_cos * x.share[0] + b.f_cos * x.share[1], a.pdf * x.chance[0] + b.pdf * x.chance[1]};
    }
    case MaterialKind::normal_map:
    case MaterialKind::bump_map: {
      const Frame frame = mapped_frame(m, look, uv, wo);
      const V3 o = frame.to_local(wo), in = frame.to_local(wi);
      if (!same_side(o, wo) || !same_side(in, wi)) return {};
      BsdfEval e = eval({m.front}, uv.seen_in(frame), o, in);
      e.f_cos *= mapped_shadow(m, frame.n, wi);
      return e;
    }
    case MaterialKind::principled:
      return eval_principled(principled_[m.front], look, wo, wi);
    default:
      return {};
  }
}

// Samples the scattering of the material `part`, of which a mask, blend or map consists; a null material
// scatters nothing.
std::optional<BsdfSample> BsdfTable::sample_part(std::uint32_t part, const UvPoint& uv, const V3& wo,
                                                 float u_lobe, V2 u) const {
  if (materials_[part].kind == MaterialKind::null) return std::nullopt;
  return sample({part}, uv, wo, u_lobe, u);
}

std::optional<BsdfSample> BsdfTable::sample_wide(const Material& m, const UvPoint& uv, const V3& wo,
                                                 float u_lobe, V2 u) const {
  const Lookup look{*textures_, uv};
  switch (m.kind) {
    case MaterialKind::thin_dielectric:
      return sample_mirror(look.reflectance(m.specular_slot) * sheet_reflectance(wo.z, m.ior), wo);
    case MaterialKind::rough_dielectric: {
      if (wo.z == 0) return std::nullopt;
      const auto rough = look.roughness(m);
      if (rough.mirror) return sample_dielectric(m, look, wo, u_lobe);
      const bool outside = wo.z > 0;
      auto s = RoughDielectric(m, look, rough.facets, outside).sample(to_side(wo, outside), u_lobe, u);
      if (s) s->wi = to_side(s->wi, outside);
      if (s && m.energy) s->weight *= m.energy->factor(std::abs(wo.z), outside);
      return s;
    }
    case MaterialKind::mask: {
      auto s = sample_part(m.front, uv, wo, u_lobe, u);
      if (s) s->weight *= look.share(m.specular_slot);
      return s;
    }
    case MaterialKind::blend: {
      const Mixture x = mixture(m, uv, wo);
      const int k = u_lobe < x.chance[1];
      const float rest = k ? u_lobe / x.chance[1] : (u_lobe - x.chance[1]) / x.chance[0];
      auto s = sample_part(k ? m.back : m.front, uv, wo, std::min(rest, 0x1.fffffep-1f), u);
      if (!s) return s;
      // If the other material contributes nothing, the result is that of this material alone, bit for bit.
      if (x.share[1 - k] == 0 && x.chance[1 - k] == 0) return s;
      if (s->delta) {
        s->weight *= x.share[k] / x.chance[k];
        s->pdf *= x.chance[k];
        return s;
      }
      const BsdfEval other = eval({k ? m.front : m.back}, uv, wo, s->wi);
      const float pdf = x.chance[k] * s->pdf + x.chance[1 - k] * other.pdf;
      s->weight = (s->weight * (x.share[k] * s->pdf) + other.f_cos * x.share[1 - k]) / pdf;
      s->pdf = pdf;
      return s;
    }
    case MaterialKind::principled:
      return sample_principled(principled_[m.front], look, wo, u_lobe, u);
    case MaterialKind::normal_map:
    case MaterialKind::bump_map: {
      const Frame frame = mapped_frame(m, look, uv, wo);
      const V3 o = frame.to_local(wo);
      if (!same_side(o, wo)) return std::nullopt;
      auto s = sample_part(m.front, uv.seen_in(frame), o, u_lobe, u);
      if (!s) return s;
      const V3 w = normalize(frame.to_world(s->wi));
      if (!same_side(w, s->wi)) return std::nullopt;
      s->wi = w;
      s->weight *= mapped_shadow(m, frame.n, w);
      return s;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace ls::render
