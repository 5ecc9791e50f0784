#include "worker/render/bsdf/principled.h"

#include <cmath>

namespace ls::render {
namespace {

constexpr float kCoatShadowing = .25f;  // GGX alpha for the coat's shadowing and masking, at every gloss

float mix(float a, float b, float t) { return a * (1 - t) + b * t; }
float fifth(float x) { return sqr(sqr(x)) * x; }
float schlick_weight(float cos) { return fifth(std::clamp(1 - cos, 0.f, 1.f)); }

// Schlick's weight w in the Fresnel reflectance F = F0 + (1 - F0) w. `cos` is the cosine of the angle of
// incidence, and eta the index of refraction behind the surface over that in front of it. If eta is below 1,
// the cosine of the refracted angle is used instead of `cos`.
float schlick(float cos, float eta) {
  return schlick_weight(eta > 1 ? cos : safe_sqrt(1 - (1 - cos) * (1 + cos) / (eta * eta)));
}
C3 schlick(const C3& f0, float w) { return f0 * (1 - w) + C3(w); }

// The clear coat's facets (GTR with exponent 1). Their alpha is 0.1 at gloss 0 and 0.001 at gloss 1. Their
// normals m have the density D(m) cos, where cos is the cosine between m and the surface normal. D is
// computed from the tangential part of m, to avoid cancellation near the normal.
struct CoatFacets {
  float a2;
  explicit CoatFacets(float gloss) : a2(sqr(mix(.1f, .001f, gloss))) {}

  float D(const V3& m) const {
    return (a2 - 1) / (kPi * std::log(a2) * (m.x * m.x + m.y * m.y + a2 * m.z * m.z));
  }
  V3 sample(const V2& u) const {
    const float sin2 = std::clamp((std::pow(a2, 1 - u.y) - a2) / (1 - a2), 0.f, 1.f);
    const V2 c = unit_circle(u.x) * std::sqrt(sin2);
    return {c.x, c.y, std::sqrt(1 - sin2)};
  }
};

// The material at one point, as seen from wo. If wo is behind the surface, everything is mirrored to the
// front and the inverse index is used, so that z > 0 is always the side of wo.
struct SeenPrincipled {
  const Principled& p;
  const Lookup& look;
  V3 wo;
  bool front;
  float metallic, brdf, bsdf, clearcoat, eta;
  Microfacets facets;
  float chance_facets, chance_coat, chance_diffuse;

  SeenPrincipled(const Principled& material, const Lookup& lookup, const V3& w)
      : p(material), look(lookup), wo(w.x, w.y, std::abs(w.z)), front(w.z > 0) {
    metallic = look.share(p.metallic);
    const float trans = look.share(p.spec_trans);
    brdf = (1 - metallic) * (1 - trans);
    bsdf = (1 - metallic) * trans;
    clearcoat = front ? look.share(p.clearcoat) : 0;
    eta = front ? p.eta : 1 / p.eta;
    const float a = sqr(look.share(p.roughness)),
                aspect = std::sqrt(1 - .9f * look.share(p.anisotropic_slot));
    facets = {Microfacet::ggx, std::max(kMinPrincipled, a / aspect), std::max(kMinPrincipled, a * aspect)};
    const float coat = .25f * clearcoat, diffuse = front ? brdf : 0, sum = 1 + coat + diffuse;
    chance_facets = 1 / sum;
    chance_coat = coat / sum;
    chance_diffuse = diffuse / sum;
  }

  // False if the material is black as seen from wo: if wo is parallel to the surface, or if wo is behind a
  // surface that refracts no light.
  bool visible() const { return wo.z > 0 && (front || bsdf > 0); }
  float fresnel(float cos) const { return static_cast<float>(fresnel_dielectric(cos, eta).reflectance); }
  // The probability that light is reflected, not refracted, at a sampled visible normal with the Fresnel
  // reflectance F.
  float reflecting(float F) const { return front ? 1 - bsdf * (1 - F) : F; }

  C3 tint(const C3& base) const {
    const float l = luminance(base);
    return l > 0 ? base / l : C3(1);
  }
  C3 reflectance(float F, float cos, const C3& base) const {
    if (!front) return C3(bsdf * F * glass_factor());
    const float w = schlick(cos, eta), tinted = look.share(p.spec_tint);
    const C3 f0 = tint(base) * sqr((eta - 1) / (eta + 1));
    if (p.metal_energy.empty())
      return C3((1 - metallic) * (1 - tinted) * F) + schlick(base, w) * metallic +
             schlick(f0, w) * ((1 - metallic) * tinted);
    // What is not metal is opaque or glass, with the shares `brdf` and `bsdf`.
    const C3 opaque = C3(brdf) * metal_factor(C3(p.mean_fresnel)) + C3(bsdf * glass_factor());
    return opaque * ((1 - tinted) * F) + schlick(base, w) * metal_factor(mean_schlick(base)) * metallic +
           schlick(f0, w) * metal_factor(mean_schlick(f0)) * ((1 - metallic) * tinted);
  }

  // The compensation for light lost between the facets, 1 if there is none: of those that only reflect, with
  // the mean reflectance `mean`, and of those of glass.
  C3 metal_factor(const C3& mean) const {
    return p.metal_energy.empty() ? C3(1) : p.metal_energy.factor(look.share(p.roughness), wo.z, mean);
  }
  float glass_factor() const {
    return p.glass_energy.empty() ? 1 : p.glass_energy.factor(look.share(p.roughness), wo.z, front);
  }
  // The mean 2 int F(mu) mu dmu of Schlick's F = F0 + (1 - F0) (1 - mu)^5
  static C3 mean_schlick(const C3& f0) { return f0 + (C3(1) - f0) * (1 / 21.f); }
};

// The diffuse lobe's part of the BSDF, times |cos wi|: diffuse reflection, retro-reflection, approximate
// subsurface scattering, and sheen. cos_d is the cosine between wo and the half vector.
C3 diffuse_f_cos(const SeenPrincipled& s, const C3& base, const V3& wi, float cos_d) {
  const float out = schlick_weight(wi.z), in = schlick_weight(s.wo.z);
  const float retro = 2 * s.look.share(s.p.roughness) * sqr(cos_d);
  const float diffuse = (1 - .5f * in) * (1 - .5f * out) + retro * (out + in + out * in * (retro - 1));
  const float flat_90 = retro / 2;
  const float below =
      1.25f * (mix(1, flat_90, out) * mix(1, flat_90, in) * (1 / (wi.z + s.wo.z) - .5f) + .5f);
  C3 f = base * (s.brdf * kInvPi * mix(diffuse, below, s.look.share(s.p.flatness)));
  const float sheen = s.look.share(s.p.sheen);
  if (sheen > 0) {
    const float tinted = s.look.share(s.p.sheen_tint);
    f += (C3(1 - tinted) + s.tint(base) * tinted) * (sheen * (1 - s.metallic) * schlick_weight(cos_d));
  }
  return f * wi.z;
}

BsdfEval eval_reflection(const SeenPrincipled& s, const C3& base, const V3& wi) {
  const V3 h = normalize(s.wo + wi);
  const float cos_d = dot(s.wo, h);
  if (!(cos_d > 0)) return {};
  const float F = s.fresnel(cos_d), D = s.facets.D(h);
  BsdfEval e;
  e.pdf = s.chance_facets * s.reflecting(F) * .25f * D * s.facets.visible_over_D(s.wo);
  // As in Mitsuba, facets reflect nothing if F is 0, as it is where the indices of refraction are equal. This
  // applies to metals, too.
  if (F > 0)
    e.f_cos = s.reflectance(F, cos_d, base) *
              (.25f * D * s.facets.G1_over_cos(s.wo) * s.facets.G1_over_cos(wi) * wi.z);
  if (!s.front) return e;
  if (s.clearcoat > 0) {
    const CoatFacets coat(s.look.share(s.p.clearcoat_gloss));
    const float G = ggx::G1_over_cos(s.wo, kCoatShadowing, kCoatShadowing) * s.wo.z *
                    ggx::G1_over_cos(wi, kCoatShadowing, kCoatShadowing) * wi.z;
    const float Dc = coat.D(h), fresnel = mix(schlick(cos_d, s.eta), 1, .04f);
    e.f_cos += C3(s.clearcoat * .25f * fresnel * Dc * G * wi.z);
    e.pdf += s.chance_coat * Dc * h.z / (4 * cos_d);
  }
  if (s.brdf > 0) {
    e.f_cos += diffuse_f_cos(s, base, wi, cos_d);
    e.pdf += s.chance_diffuse * wi.z * kInvPi;
  }
  return e;
}

// Returns the BSDF and its sampling density for a wi on the other side of the surface than wo, by the
// formulas of RoughDielectric.
BsdfEval eval_refraction(const SeenPrincipled& s, const C3& base, const V3& wi) {
  if (!s.p.transmits || !(s.bsdf > 0)) return {};
  V3 h = s.wo + wi * s.eta;
  if (h.z < 0) h = -h;
  const float q2 = dot(h, h);
  const V3 m = normalize(h);
  const float om = dot(s.wo, m), im = dot(wi, m);
  if (!(om > 0) || !(im < 0)) return {};
  const float F = s.fresnel(om), density = (1 - F) * s.facets.D(m) * om * -im / q2;
  const V3 up(wi.x, wi.y, -wi.z), root(std::sqrt(base.x), std::sqrt(base.y), std::sqrt(base.z));
  const float G = s.facets.G1_over_cos(s.wo) * s.facets.G1_over_cos(up) * up.z;
  const float share = s.chance_facets * (s.front ? s.bsdf : 1);
  return {root * (s.bsdf * density * G * s.glass_factor()),
          share * density * s.facets.visible_over_D(s.wo) * sqr(s.eta)};
}

}  // namespace

BsdfEval Principled::eval(const Lookup& look, const V3& wo, const V3& wi) const {
  const SeenPrincipled s(*this, look, wo);
  if (!s.visible() || wi.z == 0) return {};
  const C3 base = look.reflectance(base_color);
  const V3 in(wi.x, wi.y, s.front ? wi.z : -wi.z);
  return in.z > 0 ? eval_reflection(s, base, in) : eval_refraction(s, base, in);
}

std::optional<BsdfSample> Principled::sample(const Lookup& look, const V3& wo, float u_lobe,
                                             const V2& u) const {
  const SeenPrincipled s(*this, look, wo);
  if (!s.visible()) return std::nullopt;
  V3 wi;
  bool transmitted = false;
  if (u_lobe < s.chance_diffuse) {
    wi = cosine_hemisphere(u);
  } else if (u_lobe < s.chance_diffuse + s.chance_coat) {
    wi = reflect(s.wo, CoatFacets(look.share(clearcoat_gloss)).sample(u));
  } else {
    const float rest = (u_lobe - s.chance_diffuse - s.chance_coat) / s.chance_facets;
    const V3 m = s.facets.sample_visible(s.wo, u);
    const float om = dot(s.wo, m);
    if (!(om > 0)) return std::nullopt;
    const DielectricFresnel f = fresnel_dielectric(om, s.eta);
    transmitted = std::min(rest, kBelowOne) >= s.reflecting(static_cast<float>(f.reflectance));
    const auto eta_ti = static_cast<float>(f.eta_ti), im = static_cast<float>(f.cos_t);
    wi = transmitted ? m * (om * eta_ti + im) - s.wo * eta_ti : reflect(s.wo, m);
  }
  wi = normalize(wi);
  if (!(transmitted ? wi.z < 0 : wi.z > 0)) return std::nullopt;
  const C3 base = look.reflectance(base_color);
  const BsdfEval e = transmitted ? eval_refraction(s, base, wi) : eval_reflection(s, base, wi);
  if (!(e.pdf > 0)) return std::nullopt;
  BsdfSample out;
  out.wi = {wi.x, wi.y, s.front ? wi.z : -wi.z};
  out.weight = e.f_cos / e.pdf;
  out.pdf = e.pdf;
  out.transmitted = transmitted;
  out.eta = transmitted ? s.eta : 1;
  return out;
}

Principled make_material(const PrincipledBsdf& b, MaterialBuilder& builder) {
  Principled p;
  p.base_color = builder.reflectance(b.base_color);
  p.roughness = builder.reflectance(b.roughness);
  p.anisotropic_slot = builder.reflectance(b.anisotropic);
  p.metallic = builder.reflectance(b.metallic);
  p.spec_tint = builder.reflectance(b.spec_tint);
  p.sheen = builder.reflectance(b.sheen);
  p.sheen_tint = builder.reflectance(b.sheen_tint);
  p.flatness = builder.reflectance(b.flatness);
  p.clearcoat = builder.reflectance(b.clearcoat);
  p.clearcoat_gloss = builder.reflectance(b.clearcoat_gloss);
  p.transmits = b.spec_trans.has_value();
  p.spec_trans = b.spec_trans ? builder.reflectance(*b.spec_trans) : Slot{C3(0), {}, true};
  p.eta = static_cast<float>(builder.index(b.eta, 1));
  // As in Mitsuba, the index is moved away from 1: without a contrast of indices the facets would neither
  // reflect nor refract.
  if (p.transmits && std::abs(p.eta - 1) < 1e-3f) p.eta = 1.001f;
  if (!b.multiple_scattering || builder.refused()) return p;
  if (!p.anisotropic_slot.constant || p.anisotropic_slot.value != C3(0))
    builder.refuse("multiple_scattering needs the same roughness both ways, without anisotropic");
  const double eta = double{p.eta};
  p.mean_fresnel = mean_fresnel(eta);
  p.metal_energy = builder.energies(MaterialBuilder::EnergyOf::conductor, p.roughness, 1);
  if (p.transmits) p.glass_energy = builder.energies(MaterialBuilder::EnergyOf::dielectric, p.roughness, eta);
  return p;
}

}  // namespace ls::render
