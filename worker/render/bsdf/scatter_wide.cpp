// Kinds that scatter to both sides of the surface, let light pass, or consist of others. Materials that
// consist of others recurse into them, at most scene::kMaxBsdfNesting deep (checked by build()).
#include "worker/render/bsdf/lobes.h"
#include "worker/render/bsdf/rough_dielectric.h"

namespace ls::render {

namespace {

using Material = BsdfTable::Material;

// Of a sheet, with all reflections between its two sides: R + T R T + T R^3 T + ... = 2 R / (1 + R).
float sheet_reflectance(float cos, float ior) {
  const double r = fresnel_dielectric(std::abs(cos), ior).reflectance;
  return static_cast<float>(2 * r / (1 + r));
}

// The frame that a normal map's material sees, in the surface's own: s as near to the surface's as the normal
// allows.
Frame mapped_frame(const Material& m, const Lookup& look) {
  const C3 c = look.reflectance(m.specular_slot);
  return Frame::from_tangent(normalize(c * 2 - V3(1)), V3(1, 0, 0));
}
// Both frames must have a direction on the same side: nothing is lit, or seen, through the surface.
bool same_side(const V3& a, const V3& b) { return a.z * b.z > 0; }

V3 to_side(const V3& w, bool outside) { return {w.x, w.y, outside ? w.z : -w.z}; }

}  // namespace

// A blend seen from wo. `share` is each part's in the mixture, `chance` that of being sampled: parts that
// only let light pass have nothing to be sampled.
struct BsdfTable::Mixture {
  float share[2], chance[2];
};

BsdfTable::Mixture BsdfTable::mixture(const Material& m, V2 uv, const V3& wo) const {
  const float w = Lookup{*textures_, uv}.share(m.specular_slot);
  Mixture x{{1 - w, w}, {1 - w, w}};
  if (!m.veil) return x;
  x.chance[0] *= 1 - veil({m.front}, uv, wo).probability;
  x.chance[1] *= 1 - veil({m.back}, uv, wo).probability;
  const float sum = x.chance[0] + x.chance[1];
  if (sum > 0) x.chance[1] = std::min(1.f, x.chance[1] / sum);
  x.chance[0] = 1 - x.chance[1];
  return x;
}

Veil BsdfTable::veil(BsdfIndex i, V2 uv, const V3& w) const {
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
      const Veil inner = veil({m.front}, uv, w);
      return {C3(1) - (C3(1) - inner.transmission) * opacity, 1 - (1 - inner.probability) * opacity};
    }
    case MaterialKind::blend: {
      if (!m.veil) return {};
      const float weight = look.share(m.specular_slot);
      const Veil a = veil({m.front}, uv, w), b = veil({m.back}, uv, w);
      return {a.transmission * (1 - weight) + b.transmission * weight,
              a.probability * (1 - weight) + b.probability * weight};
    }
    case MaterialKind::normal_map:
      return m.veil ? veil({m.front}, uv, mapped_frame(m, look).to_local(w)) : Veil{};
    default:
      return {};
  }
}

BsdfEval BsdfTable::eval_wide(const Material& m, V2 uv, const V3& wo, const V3& wi) const {
  const Lookup look{*textures_, uv};
  switch (m.kind) {
    case MaterialKind::rough_dielectric: {
      const auto rough = look.roughness(m);
      const bool outside = wo.z > 0;
      if (rough.mirror || wo.z == 0) return {};
      return RoughDielectric(m, look, rough.facets, outside).eval(to_side(wo, outside), to_side(wi, outside));
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
    case MaterialKind::normal_map: {
      const Frame frame = mapped_frame(m, look);
      const V3 o = frame.to_local(wo), in = frame.to_local(wi);
      if (!same_side(o, wo) || !same_side(in, wi)) return {};
      return eval({m.front}, uv, o, in);
    }
    default:
      return {};
  }
}

// Of what a part of a material scatters: a part that is nothing but a veil scatters nothing.
std::optional<BsdfSample> BsdfTable::sample_part(std::uint32_t part, V2 uv, const V3& wo, float u_lobe,
                                                 V2 u) const {
  if (materials_[part].kind == MaterialKind::null) return std::nullopt;
  return sample({part}, uv, wo, u_lobe, u);
}

std::optional<BsdfSample> BsdfTable::sample_wide(const Material& m, V2 uv, const V3& wo, float u_lobe,
                                                 V2 u) const {
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
    case MaterialKind::normal_map: {
      const Frame frame = mapped_frame(m, look);
      const V3 o = frame.to_local(wo);
      if (!same_side(o, wo)) return std::nullopt;
      auto s = sample_part(m.front, uv, o, u_lobe, u);
      if (!s) return s;
      const V3 w = normalize(frame.to_world(s->wi));
      if (!same_side(w, s->wi)) return std::nullopt;
      s->wi = w;
      return s;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace ls::render
