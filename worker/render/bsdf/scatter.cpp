// eval() and sample() of BsdfTable: the lobes of the one-sided material kinds, and the calls for the other
// kinds.
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/lobes.h"

namespace ls::render {

namespace {

using Material = BsdfTable::Material;

// The lobe of diffuse materials.
BsdfEval eval_diffuse(const C3& reflectance, const V3& wi) {
  const float p = wi.z * kInvPi;
  return {reflectance * p, p};
}

// The lobes of conductors.
struct Metal {
  C3 eta, k, tint;
  C3 reflectance(float cos) const { return fresnel_conductor(std::min(cos, 1.f), eta, k) * tint; }
};

BsdfEval eval_rough_metal(const Metal& metal, const Microfacets& facets, const V3& wo, const V3& wi) {
  const V3 h = normalize(wo + wi);
  const float D = facets.D(h), G = facets.G1_over_cos(wo) * facets.G1_over_cos(wi) * wi.z;
  return {metal.reflectance(dot(wo, h)) * (.25f * D * G), D * facets.pdf_over_D(wo)};
}

// Samples a rough conductor. The weight is F G1(wi) times a ratio near 1, because D, which may be huge or
// lose digits, cancels out.
std::optional<BsdfSample> sample_rough_metal(const Metal& metal, const Microfacets& facets, const V3& wo,
                                             const V2& u) {
  const V3 h = facets.sample_normal(wo, u);
  const V3 wi = normalize(reflect(wo, h));
  const float pdf_over_D = facets.pdf_over_D(wo), pdf = facets.D(h) * pdf_over_D;
  if (!(wi.z > 0) || !(pdf > 0)) return std::nullopt;
  const float ratio = .25f * facets.G1_over_cos(wo) / pdf_over_D;
  BsdfSample s;
  s.wi = wi;
  s.weight = metal.reflectance(dot(wo, h)) * (facets.G1_over_cos(wi) * wi.z * ratio);
  s.pdf = pdf;
  return s;
}

// The lobes of plastics: a dielectric coat over a diffuse base.
float coat_reflectance(float cos, float ior) {
  return static_cast<float>(fresnel_dielectric(cos, ior).reflectance);
}

// A plastic seen from wo. With kSmooth its coat is a plane boundary, computed by Fresnel's formulas; without,
// a rough one, computed from tables.
template <bool kSmooth>
struct Plastic {
  const Material& m;
  C3 diffuse, tint;
  Microfacets facets;
  float t_o;         // the coat's transmittance towards wo
  float p_specular;  // probability that the coat is sampled

  Plastic(const Material& material, const Lookup& look, const V3& wo)
      : m(material),
        diffuse(look.reflectance(m.second_slot)),
        tint(look.reflectance(m.specular_slot)),
        facets{m.distribution, m.alpha_u.value.x, m.alpha_v.value.x},
        t_o(through(m, wo.z)) {
    const float s = (1 - t_o) * m.specular_weight, d = t_o * (1 - m.specular_weight);
    p_specular = s + d > 0 ? s / (s + d) : .5f;
  }

  static float through(const Material& m, float cos) {
    if (kSmooth) return 1 - coat_reflectance(cos, m.ior);
    return m.energy ? m.energy->through.at(cos) : m.coat.at(cos);
  }
  // The value f |cos wi| of the light that entered the coat, was scattered any number of times below it, and
  // left again.
  C3 diffuse_f_cos(const V3& wi) const {
    const float r = m.coat.internal_reflectance;
    const C3 inside = m.nonlinear ? C3(1) - diffuse * r : C3(1 - r);
    return diffuse / inside * (kInvPi / (m.ior * m.ior) * wi.z * t_o * through(m, wi.z));
  }
};

template <bool kSmooth>
BsdfEval eval_plastic(const Plastic<kSmooth>& p, const V3& wo, const V3& wi) {
  BsdfEval e{p.diffuse_f_cos(wi), (1 - p.p_specular) * wi.z * kInvPi};
  if (p.m.specular) return e;
  const V3 h = normalize(wo + wi);
  const float D = p.facets.D(h), G = p.facets.G1_over_cos(wo) * p.facets.G1_over_cos(wi) * wi.z;
  C3 coat = p.tint * (coat_reflectance(dot(wo, h), p.m.ior) * .25f * D * G);
  if (p.m.energy) coat *= p.m.energy->factor(wo.z, true);
  e.f_cos += coat;
  e.pdf += p.p_specular * D * p.facets.pdf_over_D(wo);
  return e;
}

template <bool kSmooth>
std::optional<BsdfSample> sample_plastic(const Plastic<kSmooth>& p, const V3& wo, float u_lobe, const V2& u) {
  const bool coat = u_lobe < p.p_specular;
  if (coat && p.m.specular) {
    auto s = sample_mirror(p.tint * (coat_reflectance(wo.z, p.m.ior) / p.p_specular), wo);
    s->pdf = p.p_specular;
    return s;
  }
  BsdfSample s;
  s.wi = coat ? normalize(reflect(wo, p.facets.sample_normal(wo, u))) : cosine_hemisphere(u);
  if (!(s.wi.z > 0)) return std::nullopt;
  const BsdfEval e = eval_plastic(p, wo, s.wi);
  if (!(e.pdf > 0)) return std::nullopt;
  s.weight = e.f_cos / e.pdf;
  s.pdf = e.pdf;
  return s;
}

std::optional<BsdfSample> sample_diffuse(const C3& reflectance, const V2& u) {
  BsdfSample s;
  s.wi = cosine_hemisphere(u);
  s.weight = reflectance;
  s.pdf = s.wi.z * kInvPi;
  if (!(s.pdf > 0)) return std::nullopt;
  return s;
}

V3 flipped(const V3& w) { return {w.x, w.y, -w.z}; }

}  // namespace

// Uniform diffuse, the most common material, is handled here without the overhead of the others.
BsdfEval BsdfTable::eval(BsdfIndex i, const UvPoint& uv, const V3& wo, const V3& wi) const {
  const Material* m = &materials_[i.value];
  V3 o = wo, in = wi;
  if (m->kind == MaterialKind::two_sided) {
    m = &materials_[o.z < 0 ? m->back : m->front];
    if (o.z < 0) o = flipped(o), in = flipped(in);
  }
  if (m->kind >= kFirstWide) return eval_wide(*m, uv, o, in);
  if (!(o.z > 0) || !(in.z > 0)) return {};  // no other kind has a smooth lobe on the back
  if (m->kind == MaterialKind::diffuse) return eval_diffuse(m->second_slot.value, in);
  return eval_lobes(*m, uv, o, in);
}

BsdfEval BsdfTable::eval_lobes(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const {
  const Lookup look{*textures_, uv};
  switch (m.kind) {
    case MaterialKind::textured_diffuse:
      return eval_diffuse(look.reflectance(m.second_slot), wi);
    case MaterialKind::rough_conductor: {
      const auto rough = look.roughness(m);
      if (rough.mirror) return {};
      const Metal metal{m.eta, m.k, look.reflectance(m.specular_slot)};
      BsdfEval e = eval_rough_metal(metal, rough.facets, wo, wi);
      if (m.energy) e.f_cos *= m.energy->factor(wo.z, metal.tint * m.mean_fresnel);
      return e;
    }
    case MaterialKind::rough_plastic:
      return eval_plastic(Plastic<false>(m, look, wo), wo, wi);
    case MaterialKind::plastic:
      return eval_plastic(Plastic<true>(m, look, wo), wo, wi);
    default:
      return {};
  }
}

std::optional<BsdfSample> BsdfTable::sample(BsdfIndex i, const UvPoint& uv, const V3& wo, float u_lobe,
                                            V2 u) const {
  const Material* m = &materials_[i.value];
  V3 o = wo;
  const bool from_behind = m->kind == MaterialKind::two_sided && o.z < 0;
  if (m->kind == MaterialKind::two_sided) m = &materials_[from_behind ? m->back : m->front];
  if (from_behind) o = flipped(o);
  std::optional<BsdfSample> s;
  if (m->kind != MaterialKind::diffuse)
    s = m->kind >= kFirstWide ? sample_wide(*m, uv, o, u_lobe, u) : sample_lobes(*m, uv, o, u_lobe, u);
  else if (o.z > 0)
    s = sample_diffuse(m->second_slot.value, u);
  if (s && from_behind) s->wi = flipped(s->wi);
  return s;
}

std::optional<BsdfSample> BsdfTable::sample_lobes(const Material& m, const UvPoint& uv, const V3& wo,
                                                  float u_lobe, V2 u) const {
  if (m.kind == MaterialKind::null) {
    BsdfSample s;
    s.wi = -wo;
    s.weight = C3(1);
    s.pdf = 1;
    s.delta = s.transmitted = true;
    return s;
  }
  const Lookup look{*textures_, uv};
  if (m.kind == MaterialKind::dielectric)
    return wo.z != 0 ? sample_dielectric(m, look, wo, u_lobe) : std::nullopt;
  if (!(wo.z > 0)) return std::nullopt;
  const auto metal = [&] { return Metal{m.eta, m.k, look.reflectance(m.specular_slot)}; };
  switch (m.kind) {
    case MaterialKind::textured_diffuse:
      return sample_diffuse(look.reflectance(m.second_slot), u);
    case MaterialKind::conductor:
      return sample_mirror(metal().reflectance(wo.z), wo);
    case MaterialKind::rough_conductor: {
      const auto rough = look.roughness(m);
      auto s = rough.mirror ? sample_mirror(metal().reflectance(wo.z), wo)
                            : sample_rough_metal(metal(), rough.facets, wo, u);
      if (s && m.energy) s->weight *= m.energy->factor(wo.z, metal().tint * m.mean_fresnel);
      return s;
    }
    case MaterialKind::rough_plastic:
      return sample_plastic(Plastic<false>(m, look, wo), wo, u_lobe, u);
    case MaterialKind::plastic:
      return sample_plastic(Plastic<true>(m, look, wo), wo, u_lobe, u);
    default:
      return std::nullopt;
  }
}

}  // namespace ls::render
