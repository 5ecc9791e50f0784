#include "worker/render/bsdf/conductor.h"

#include <cmath>

namespace ls::render {
namespace {

constexpr double kGrazing = 1e-6;  // the tables use this cosine in place of smaller ones
// The largest error of the tables that this file computes. This value is subtracted from the share of light
// that stays in the coat, so that table errors cannot make a surface reflect more light than it receives.
constexpr double kTolerance = 2e-3;

// Returns the direction w refracted into the coat, with z > 0: light along it leaves the coat along w. The z
// is 0 if there is no such direction, because the coat's index is below that outside and w is beyond the
// critical angle.
V3 refracted(const V3& w, float ior) {
  const auto cos_t = static_cast<float>(-fresnel_dielectric(w.z, ior).cos_t);
  return {w.x / ior, w.y / ior, cos_t};
}

// A coated conductor at one point of a surface, as seen from the direction wo. The value of the BSDF has
// three parts: `coat`, `metal` and `rest` (conductor.h). inner_o is wo refracted into the coat, the suffixes
// _o and _i refer to wo and wi, and p_coat, p_base and p_rest are the probabilities of sampling the parts.
struct SeenCoatedConductor {
  const RoughCoatedConductor& m;
  V3 wo, inner_o;
  Metal metal;
  RoughCoatedConductor::Shares coat_o;
  float staying_o;
  // Colour of the part `rest` of the BSDF, that is, of light that stays in the coat after its first
  // reflection by the metal.
  C3 rest;
  float p_coat, p_base, p_rest;

  SeenCoatedConductor(const RoughCoatedConductor& material, const Lookup& look, const V3& w)
      : m(material), wo(w), inner_o(refracted(w, m.ior)), metal(m.metal(look)) {
    coat_o = m.shares(wo.z);
    if (!(inner_o.z > 0)) coat_o.through = 0;
    staying_o = m.tables.staying.at(wo.z);
    // Light that stays in the coat has been reflected once by the metal, with the factor F. It meets the
    // metal at least once more, each time with the factor `again`. After each such reflection the share
    // `leaving` leaves the coat and the share `internal` is reflected back to the metal.
    const C3 F = m.mean_fresnel * metal.tint, again = F * m.tables.metal_albedo;
    rest = F * again * m.tables.leaving / (C3(1) - again * m.tables.internal);
    p_coat = coat_o.reflected;
    p_base = coat_o.through > 0 ? sqr(coat_o.through) *
                                      mean_component(series(metal.reflectance(inner_o.z), coat_o.reflected))
                                : 0;
    p_rest = staying_o * mean_component(rest);
    const float sum = p_coat + p_base + p_rest;
    if (sum > 0)
      p_coat /= sum, p_base /= sum, p_rest /= sum;
    else
      p_base = 1;
  }

  // The sum R + R F R + ... = R / (1 - F R) of the reflections between a metal of reflectance R and a coat of
  // reflectance F, computed without cancellation where R is near 1.
  static C3 series(const C3& R, float F) { return R / ((C3(1) - R) + R * (1 - F)); }

  void add_coat(BsdfEval& e, const V3& wi) const {
    const V3 h = normalize(wo + wi);
    const float D = m.coat.D(h), G = m.coat.G1_over_cos(wo) * m.coat.G1_over_cos(wi) * wi.z;
    const auto F = static_cast<float>(fresnel_dielectric(dot(wo, h), m.ior).reflectance);
    e.f_cos += C3(F * .25f * D * G);
    e.pdf += p_coat * D * m.coat.pdf_over_D(wo);
  }
  void add_base(BsdfEval& e, const V3& wi) const {
    const V3 inner_i = refracted(wi, m.ior);
    const auto coat_i = m.shares(wi.z);
    if (!(coat_o.through > 0) || !(coat_i.through > 0) || !(inner_i.z > 0)) return;
    const V3 h = normalize(inner_o + inner_i);
    const float D = m.base.D(h), G = m.base.G1_over_cos(inner_o) * m.base.G1_over_cos(inner_i);
    // The cosine of wi times 1 / n^2. n is the coat's index, and 1 / n^2 is the ratio of the projected solid
    // angles inside the coat and outside.
    const float squeezed = wi.z / sqr(m.ior);
    e.f_cos += series(metal.reflectance(dot(inner_o, h)), std::min(coat_o.reflected, coat_i.reflected)) *
               (coat_o.through * coat_i.through * squeezed * .25f * D * G);
    e.pdf += p_base * D * m.base.pdf_over_D(inner_o) * squeezed / inner_i.z;
  }

  BsdfEval eval(const V3& wi) const {
    BsdfEval e;
    if (!m.coat_is_smooth) add_coat(e, wi);
    add_base(e, wi);
    if (m.tables.staying_mean > 0) {
      e.f_cos += rest * (staying_o * m.tables.staying.at(wi.z) / m.tables.staying_mean * kInvPi * wi.z);
      e.pdf += p_rest * wi.z * kInvPi;
    }
    return e;
  }

  // Samples wi for the part `metal` of the BSDF. If the sampled light does not leave the coat, the result has
  // z <= 0.
  V3 sample_base(const V2& u) const {
    if (!(inner_o.z > 0)) return {0, 0, 0};
    const V3 w = normalize(reflect(inner_o, m.base.sample_normal(inner_o, u)));
    const float x = w.x * m.ior, y = w.y * m.ior, z2 = 1 - x * x - y * y;
    return w.z > 0 && z2 > 0 ? V3(x, y, std::sqrt(z2)) : V3(0, 0, 0);
  }

  std::optional<BsdfSample> sample(float u_lobe, const V2& u) const {
    BsdfSample s;
    if (u_lobe < p_coat && m.coat_is_smooth) {
      s = *sample_mirror(C3(coat_o.reflected / p_coat), wo);
      s.pdf = p_coat;
      return s;
    }
    if (u_lobe < p_coat)
      s.wi = normalize(reflect(wo, m.coat.sample_normal(wo, u)));
    else if (u_lobe < p_coat + p_base)
      s.wi = sample_base(u);
    else
      s.wi = cosine_hemisphere(u);
    if (!(s.wi.z > 0)) return std::nullopt;
    const BsdfEval e = eval(s.wi);
    if (!(e.pdf > 0)) return std::nullopt;
    s.weight = e.f_cos / e.pdf;
    s.pdf = e.pdf;
    return s;
  }
};

// Calls f(wi, weight) for a set of directions wi into which a metal that absorbs nothing reflects light from
// wo. wi and wo are inside the coat. The weights sum to the share of the light that the metal's facets do not
// mask.
template <class F>
void for_reflections(const Microfacets& facets, const V3& wo, F f) {
  constexpr int kSteps = 32;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      // Each row has azimuths at equal steps; from row to row they move by 0.618 of a step (the golden
      // ratio), so that no two rows have equal azimuths.
      const double row = (i + .5) / kSteps, turn = .6180339887498949 * i;
      const V2 u(static_cast<float>((j + turn - std::floor(turn)) / kSteps), static_cast<float>(row));
      const V3 wi = normalize(reflect(wo, facets.sample_visible(wo, u)));
      if (wi.z > 0) f(wi, double{facets.G1_over_cos(wi) * wi.z} / (kSteps * kSteps));
    }
}

V3 at_cosine(double mu, double phi) {
  const double sine = std::sqrt((1 - mu) * (1 + mu));
  return {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
          static_cast<float>(mu)};
}

// The shares of light from one side that a rough coat reflects and transmits, as tables over the cosine on
// that side.
struct RoughShares {
  CosineTable reflected, refracted;

  RoughShares(double alpha, double eta)
      : reflected(of(Way::reflected, alpha, eta), kTolerance),
        refracted(of(Way::refracted, alpha, eta), kTolerance) {}

  static std::function<double(double)> of(Way way, double alpha, double eta) {
    static const Quadrature kNodes = gauss_legendre(32);
    return [=](double mu) {
      return rough_share(way, Microfacet::ggx, alpha, eta, std::max(mu, kGrazing), kNodes);
    };
  }
};

// Computes the tables of a material whose other members are set.
class Tabulator {
 public:
  explicit Tabulator(const RoughCoatedConductor& m) : m_(m) {}

  CoatedConductorTables run() {
    CoatedConductorTables& t = m_.tables;
    const double ior = double{m_.ior};
    if (m_.coat_is_smooth) {
      const double r = internal_diffuse_reflectance(ior);
      t.internal = static_cast<float>(r);
      t.leaving = static_cast<float>(1 - r);
    } else {
      const RoughShares outside(double{m_.coat.ax}, ior);
      inside_.emplace(double{m_.coat.ax}, 1 / ior);
      t.reflected = outside.reflected;
      // Light crosses the coat once in each direction, and on the way out more of it is masked or reflected
      // back. The BSDF must be reciprocal, so each crossing gets the geometric mean of both transmittances,
      // but at most that of the way in.
      t.through = CosineTable(
          [&](double mu) {
            const auto z = static_cast<float>(std::max(mu, kGrazing));
            const float in = outside.refracted.at(z), cos_t = refracted(at_cosine(double{z}, 0), m_.ior).z,
                        out = cos_t > 0 ? inside_->refracted.at(cos_t) : 0;
            return double{std::min(in, std::sqrt(in * out))};
          },
          kTolerance);
      entering_ = outside.refracted;
      t.internal = static_cast<float>(inside_->reflected.mean());
      t.leaving = static_cast<float>(inside_->refracted.mean());
    }
    t.metal_albedo = static_cast<float>(metal_albedo());
    t.staying = CosineTable(
        [&](double mu) {
          const double z = std::max(mu, kGrazing);
          if (!m_.anisotropic()) return staying(at_cosine(z, 0));
          // The table has no azimuth. It gets the least share at three azimuths, so that at none of them the
          // surface reflects more light than it receives.
          return std::min({staying(at_cosine(z, 0)), staying(at_cosine(z, .25 * M_PI)),
                           staying(at_cosine(z, .5 * M_PI))});
        },
        kTolerance);
    t.staying_mean = static_cast<float>(t.staying.mean());
    return t;
  }

 private:
  double metal_albedo() const {
    constexpr int kCosines = 32;
    double sum = 0;
    for (int i = 0; i < kCosines; ++i) {
      const double mu = (i + .5) / kCosines;
      for_reflections(m_.base, at_cosine(mu, .25 * M_PI),
                      [&](const V3&, double weight) { sum += weight * 2 * mu / kCosines; });
    }
    return std::min(sum, 1.);
  }

  // Returns the share of light from wo that stays in the coat after its first reflection by a metal that
  // absorbs nothing, minus kTolerance, but at least 0. This is the light that the metal's facets do not mask
  // and that the part `metal` of the BSDF (conductor.h) does not contain.
  double staying(const V3& wo) const {
    const V3 inner = refracted(wo, m_.ior);
    const auto coat_o = m_.shares(wo.z);
    if (!(inner.z > 0) || !(coat_o.through > 0)) return 0;
    const double entering = double{m_.coat_is_smooth ? coat_o.through : entering_.at(wo.z)};
    double sum = 0;
    for_reflections(m_.base, inner, [&](const V3& wi, double weight) {
      const double x = double{wi.x} * double{m_.ior}, y = double{wi.y} * double{m_.ior},
                   z2 = 1 - x * x - y * y;
      double kept = 1, leaves = 0;
      if (!m_.coat_is_smooth)
        kept = double{inside_->reflected.at(wi.z)} + double{inside_->refracted.at(wi.z)};
      if (z2 > 0) {
        const auto coat_i = m_.shares(static_cast<float>(std::sqrt(z2)));
        leaves = double{coat_o.through} * double{coat_i.through} /
                 (1 - double{std::min(coat_o.reflected, coat_i.reflected)});
      }
      sum += weight * (entering * std::min(kept, 1.) - leaves);
    });
    return std::max(sum - kTolerance, 0.);
  }

  RoughCoatedConductor m_;
  // Set only if the coat is rough: the shares of light from inside that it reflects and transmits, and its
  // transmittance for light from outside.
  std::optional<RoughShares> inside_;
  CosineTable entering_;
};

}  // namespace

BsdfEval RoughCoatedConductor::eval(const Lookup& look, const V3& wo, const V3& wi) const {
  return SeenCoatedConductor(*this, look, wo).eval(wi);
}
std::optional<BsdfSample> RoughCoatedConductor::sample(const Lookup& look, const V3& wo, float u_lobe,
                                                       const V2& u) const {
  return SeenCoatedConductor(*this, look, wo).sample(u_lobe, u);
}

std::variant<Conductor, RoughConductor, CoatedConductor, RoughCoatedConductor> make_material(
    const CoatedConductorBsdf& b, MaterialBuilder& builder) {
  const double ior = builder.index(b.int_ior, b.ext_ior);
  // Facets of a larger roughness than this mask all but 1e-4 of the light, so larger values make no
  // difference.
  constexpr double kLargestAlpha = 1e4;
  const auto alpha = [&](double given) {
    const double a = double{builder.roughness(Microfacet::ggx, given).u.value.x};
    return std::min(a, kLargestAlpha);
  };
  const double coat = alpha(b.coat_alpha), u = alpha(b.alpha_u), v = alpha(b.alpha_v);
  const bool mirror = u < double{kSpecularAlpha} && v < double{kSpecularAlpha};
  CoatedConductorBsdf inside = b;
  for (std::size_t c = 0; c < 3; ++c) inside.eta[c] /= b.int_ior, inside.k[c] /= b.int_ior;
  auto m = metal_of<RoughCoatedConductor>(inside, builder);
  if (builder.refused()) return static_cast<const Conductor&>(m);
  m.ior = static_cast<float>(ior);
  m.coat_is_smooth = coat < double{kSpecularAlpha};
  if (ior == 1) {  // a coat with the index of the outside is invisible
    if (mirror) return static_cast<const Conductor&>(m);
    RoughConductor plain;
    static_cast<Conductor&>(plain) = m;
    plain.roughness = {
        Microfacet::ggx, {C3(static_cast<float>(u)), {}, true}, {C3(static_cast<float>(v)), {}, true}};
    return plain;
  }
  if (mirror && m.coat_is_smooth) return static_cast<const CoatedConductor&>(m);
  const double refractions = m.coat_is_smooth ? 0 : coat * std::abs(ior - 1) / (ior * std::sqrt(2.));
  const auto seen = [&](double a) {
    return static_cast<float>(std::max(std::hypot(a, refractions), double{kMinAlpha}));
  };
  m.base = {Microfacet::ggx, seen(u), seen(v)};
  m.coat = {Microfacet::ggx, static_cast<float>(coat), static_cast<float>(coat)};
  m.mean_fresnel = mean_fresnel(m.eta, m.k);
  m.tables =
      builder.coated_conductor({m.ior, m.coat.ax, m.base.ax, m.base.ay}, [&] { return Tabulator(m).run(); });
  return m;
}

}  // namespace ls::render
