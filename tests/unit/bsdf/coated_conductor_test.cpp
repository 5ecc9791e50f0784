// Compares the coated metal with its exact smooth case, and with a random walk between coat and metal that
// shares no code with it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <complex>
#include <random>
#include <vector>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render::test {
namespace {

// The random walk, in double
namespace walking {
struct D3 {
  double x, y, z;
};
D3 operator+(const D3& a, const D3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
D3 operator*(const D3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(const D3& a, const D3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
D3 unit(const D3& a) { return a * (1 / std::sqrt(dot(a, a))); }

// Fresnel reflectance by complex refraction: cos' = sqrt(1 - sin^2 / n^2). n is the index on the other side
// over that on this side.
double reflectance(double cos, std::complex<double> n) {
  const std::complex<double> inside = std::sqrt(1. - (1 - cos * cos) / (n * n));
  return .5 * (std::norm((cos - n * inside) / (cos + n * inside)) +
               std::norm((n * cos - inside) / (n * cos + inside)));
}

class Walk {
 public:
  using Rgb3 = std::array<double, 3>;
  struct End {
    D3 wi{0, 0, 0};  // z is 0 if the light was lost between facets
    Rgb3 weight{0, 0, 0};
  };
  double ior, coat, alpha_u, alpha_v;
  std::array<std::complex<double>, 3> metal;  // relative to a vacuum
  bool lossless = false;                      // the metal absorbs nothing
  std::mt19937_64 rng{7};

  End from(const D3& wo) {
    Rgb3 w{1, 1, 1};
    D3 m = normal(wo, coat, coat);
    const double F = reflectance(dot(wo, m), ior);
    if (uniform() < F) return out(mirror(wo, m), w, coat);
    D3 v = bent(wo, m, ior);  // points down, towards the metal
    if (!(v.z < 0)) return {};
    scale(w, masking(v, coat, coat));
    for (int bounces = 0; bounces < 1000; ++bounces) {
      const D3 up = v * -1;  // points back to where the light came from
      m = normal(up, alpha_u, alpha_v);
      const D3 r = mirror(up, m);
      if (!(r.z > 0)) return {};
      for (std::size_t c = 0; c < 3; ++c)
        w[c] *= (lossless ? 1 : reflectance(dot(up, m), metal[c] / ior)) * masking(r, alpha_u, alpha_v);
      // The coat from inside, turned upside down
      const D3 at{-r.x, -r.y, r.z};
      m = normal(at, coat, coat);
      const double n = 1 / ior, c = dot(at, m), inner = (1 - c * c) / (n * n) >= 1 ? 1 : reflectance(c, n);
      if (uniform() >= inner) {
        const D3 t = bent(at, m, n);
        return out({t.x, t.y, -t.z}, w, coat);
      }
      const D3 s = mirror(at, m);
      if (!(s.z > 0)) return {};
      scale(w, masking(s, coat, coat));
      v = {s.x, s.y, -s.z};
    }
    return {};
  }

 private:
  double uniform() { return static_cast<double>(rng() >> 11) * 0x1p-53; }
  static void scale(Rgb3& w, double s) {
    for (double& x : w) x *= s;
  }
  static End out(const D3& wi, Rgb3 w, double alpha) {
    if (!(wi.z > 0)) return {};
    scale(w, masking(wi, alpha, alpha));
    return {wi, w};
  }
  static double masking(const D3& w, double au, double av) {
    const double tan2 = (au * au * w.x * w.x + av * av * w.y * w.y) / (w.z * w.z);
    return 2 / (1 + std::sqrt(1 + tan2));
  }
  static D3 mirror(const D3& w, const D3& m) { return m * (2 * dot(w, m)) + w * -1; }
  // The direction into which a facet refracts light from w. n is the index on the other side over that on
  // this side.
  static D3 bent(const D3& w, const D3& m, double n) {
    const double c = dot(w, m), t = std::sqrt(1 - (1 - c * c) / (n * n));
    return m * (c / n - t) + w * (-1 / n);
  }
  // Samples a normal that is visible from w (Heitz 2018)
  D3 normal(const D3& w, double au, double av) {
    const double x = uniform(), y = uniform();
    if (au == 0) return {0, 0, 1};
    const D3 h = unit({au * w.x, av * w.y, w.z});
    const double l2 = h.x * h.x + h.y * h.y, l = std::sqrt(l2);
    const D3 a = l2 > 0 ? D3{-h.y / l, h.x / l, 0} : D3{1, 0, 0};
    const D3 b{h.y * a.z - h.z * a.y, h.z * a.x - h.x * a.z, h.x * a.y - h.y * a.x};
    const double r = std::sqrt(x), p = 2 * M_PI * y, t1 = r * std::cos(p), s = .5 * (1 + h.z);
    const double t2 = (1 - s) * std::sqrt(1 - t1 * t1) + s * r * std::sin(p);
    const D3 n = a * t1 + b * t2 + h * std::sqrt(std::max(0., 1 - t1 * t1 - t2 * t2));
    return unit({au * n.x, av * n.y, std::max(n.z, 1e-12)});
  }
};

}  // namespace walking
using walking::Walk;

const Rgb kWhiteEta{0, 0, 0}, kWhiteK{1, 1, 1};

// The distribution of light over directions, in 6 rings of equal projected solid angle with 8 sectors each,
// and its sum per channel.
constexpr int kRings = 6, kSectors = 8;
struct Light {
  std::vector<double> cells = std::vector<double>(kRings * kSectors, 0);  // the green channel
  std::array<double, 3> sum{};
  void add(double x, double y, double z, const std::array<double, 3>& w) {
    const int ring = std::clamp(static_cast<int>((1 - z * z) * kRings), 0, kRings - 1);
    const int sector =
        std::clamp(static_cast<int>((std::atan2(y, x) / M_PI + 1) * .5 * kSectors), 0, kSectors - 1);
    cells[static_cast<std::size_t>(ring * kSectors + sector)] += w[1];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += w[c];
  }
  void divide(double n) {
    for (double& x : cells) x /= n;
    for (double& x : sum) x /= n;
  }
};
Light of_walk(Walk& walk, const V3& wo, int n) {
  Light l;
  for (int i = 0; i < n; ++i) {
    const auto e = walk.from({double{wo.x}, double{wo.y}, double{wo.z}});
    if (e.wi.z > 0) l.add(e.wi.x, e.wi.y, e.wi.z, e.weight);
  }
  l.divide(n);
  return l;
}
Light of_model(const Bench& b, const V3& wo, int n) {
  Light l;
  std::mt19937 rng(5);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (int i = 0; i < n; ++i) {
    const float u = uniform(), x = uniform(), y = uniform();
    if (const auto s = b.sample(wo, u, {x, y}))
      l.add(double{s->wi.x}, double{s->wi.y}, double{s->wi.z},
            {double{s->weight.x}, double{s->weight.y}, double{s->weight.z}});
  }
  l.divide(n);
  return l;
}

// F + T^2 R / (1 - F R), by complex refraction.
double exact(double cos, double ior, std::complex<double> metal) {
  const double F = walking::reflectance(cos, ior), inside = std::sqrt(1 - (1 - cos * cos) / (ior * ior));
  const double R = walking::reflectance(inside, metal / ior);
  return F + (1 - F) * (1 - F) * R / (1 - F * R);
}

TEST(CoatedConductor, SmoothOverSmoothIsTheExactSumOfAllInnerReflections) {
  for (const double ior : {1.001, 1.33, 1.5, 2.4})
    for (const double mu : {1., .7, .3, .02}) {
      const V3 wo = direction(mu, 1);
      const auto s = bench(coated(0, 0, 0, kGoldEta, kGoldK, ior))->sample(wo, .3f, {.2f, .7f});

      ASSERT_TRUE(s);
      EXPECT_TRUE(s->delta);
      EXPECT_EQ(s->wi, (V3{-wo.x, -wo.y, wo.z}));
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<std::size_t>(c);
        // The rounding error of some tens of float32 operations on numbers up to 1
        EXPECT_NEAR(s->weight[c], exact(double{wo.z}, ior, {kGoldEta[i], kGoldK[i]}), 3e-6)
            << ior << " " << mu << " " << c;
      }
    }
}

TEST(CoatedConductor, CoatOfIndexOneEqualsTheBareMetal) {
  std::mt19937 rng(3);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (const double alpha : {0., .2}) {
    const auto coat = bench(coated(.3, alpha, alpha, kGoldEta, kGoldK, 1)),
               metal = bench(rough_metal(Microfacet::ggx, alpha, alpha, kGoldEta, kGoldK));
    for (int i = 0; i < 1000; ++i) {
      const V3 wo = direction(double{uniform()}, 6 * double{uniform()});
      const float l = uniform(), x = uniform(), y = uniform();
      const auto a = coat->sample(wo, l, {x, y}), b = metal->sample(wo, l, {x, y});
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      EXPECT_EQ(a->wi, b->wi);
      EXPECT_EQ(a->weight, b->weight);
      EXPECT_EQ(coat->eval(wo, a->wi).f_cos, metal->eval(wo, a->wi).f_cos);
    }
  }
}

// Allows 5 standard errors. Where almost nothing is lost, all weights are near 1 and the standard error is
// small.
TEST(CoatedConductor, NeverReflectsMoreThanItReceives) {
  for (const double ior : {.7, 1.5, 2.4})
    for (const double coat : {0., .002, .1, 1.})
      for (const auto& [u, v] : {std::pair{0., 0.}, {.002, .002}, {.1, .1}, {.5, .5}, {.6, .1}}) {
        const auto b = bench(coated(coat, u, v, kWhiteEta, kWhiteK, ior));
        for (const double mu : {1., .6, .2, .01})
          for (const double phi : {0., .5, 1.5}) {
            const SampledAlbedo e = sampled_albedo(*b, direction(mu, phi), 10000);
            EXPECT_LE(e.mean, 1 + 5 * e.error + 1e-5)
                << ior << " " << coat << " " << u << " " << v << " " << mu << " " << phi;
            EXPECT_LT(e.error, .01) << ior << " " << coat << " " << u << " " << v << " " << mu << " " << phi;
          }
      }
}

// At small roughnesses the model must lose nothing, and all light must be near the mirror's direction. .0011
// is just above the roughness of a mirror. Near the angle of total reflection inside the coat the lobe is
// twice as wide.
TEST(CoatedConductor, ConvergesToTheSmoothCase) {
  for (const double mu : {1., .6, .2}) {
    const V3 wo = direction(mu, 1);
    for (const auto& [coat, metal] : {std::pair{0., .0011}, {.0011, 0.}, {.0011, .0011}}) {
      const Light l = of_model(*bench(coated(coat, metal, metal, kGoldEta, kGoldK)), wo, 40000);
      for (std::size_t c = 0; c < 3; ++c)
        // Allows 5 standard errors of weights that differ by less than .2, the tolerance of the tables, and
        // the 1 % of the light that is outside of the narrow lobe: in a GGX tail, 1 / 101 is beyond ten times
        // alpha
        EXPECT_NEAR(l.sum[c], exact(double{wo.z}, 1.5, {kGoldEta[c], kGoldK[c]}), .005 + .01)
            << mu << " " << coat << " " << metal;
    }
  }
}

constexpr int kWalks = 40000;
// The noise of the difference between walk and model. Of a sum it is 5 standard errors, each at most sqrt(2 /
// n) / 2. A cell with the share p has sqrt(2 p / n), and half the sum over 48 cells has a mean of at most
// sqrt(48 * 2 / n) / 2 = .025.
constexpr double kSumNoise = .018, kCellNoise = .03;

struct Deviation {
  // `less` and `more`: by how much the sums are below and above those of the walk. `cells`: the total
  // variation distance of the green channel.
  double less = 0, more = 0, cells = 0;
};
// Returns the largest deviation over four directions.
Deviation deviation(double coat, double u, double v, bool white) {
  const Rgb eta = white ? kWhiteEta : kGoldEta, k = white ? kWhiteK : kGoldK;
  const auto b = bench(coated(coat, u, v, eta, k));
  Deviation d;
  for (const double mu : {.98, .7, .4, .1}) {
    Walk walk{1.5, coat, u, v, {}, white};
    for (std::size_t c = 0; c < 3; ++c) walk.metal[c] = {eta[c], k[c]};
    const V3 wo = direction(mu, .3);
    const Light w = of_walk(walk, wo, kWalks), m = of_model(*b, wo, kWalks);
    for (std::size_t c = 0; c < 3; ++c) {
      d.less = std::max(d.less, w.sum[c] - m.sum[c]);
      d.more = std::max(d.more, m.sum[c] - w.sum[c]);
    }
    double cells = 0;
    for (std::size_t i = 0; i < w.cells.size(); ++i) cells += .5 * std::abs(w.cells[i] - m.cells[i]);
    d.cells = std::max(d.cells, cells);
  }
  std::printf("[   walk   ] %s, coat %.2f, metal %.2f x %.2f: -%.3f +%.3f of the light, %.3f elsewhere\n",
              white ? "white" : "gold", coat, u, v, d.less, d.more, d.cells);
  return d;
}

// The limits are those stated in docs/design/coated-metal.md.
TEST(CoatedConductor, SmoothCoatMatchesARandomWalk) {
  for (const bool white : {true, false})
    for (const auto& [u, v] : {std::pair{.02, .02}, {.1, .1}, {.3, .3}, {.6, .6}, {.4, .1}}) {
      const Deviation d = deviation(0, u, v, white);
      EXPECT_LE(d.less, .01 + kSumNoise) << white << " " << u << " " << v;
      EXPECT_LE(d.more, .07 + kSumNoise) << white << " " << u << " " << v;
      EXPECT_LE(d.cells, .15 + kCellNoise) << white << " " << u << " " << v;
      if (v >= .3) {
        EXPECT_LE(d.more, .04 + kSumNoise) << white << " " << u;
        EXPECT_LE(d.cells, .045 + kCellNoise) << white << " " << u;
      }
    }
}

TEST(CoatedConductor, RoughCoatRoughlyMatchesARandomWalk) {
  for (const bool white : {true, false})
    for (const double coat : {.1, .3, .6})
      for (const double metal : {0., .1, .3, .6}) {
        const Deviation d = deviation(coat, metal, metal, white);
        EXPECT_LE(d.less, .06 + kSumNoise) << white << " " << coat << " " << metal;
        EXPECT_LE(d.more, .14 + kSumNoise) << white << " " << coat << " " << metal;
        EXPECT_LE(d.cells, .17 + kCellNoise) << white << " " << coat << " " << metal;
      }
}

TEST(CoatedConductor, StaysFiniteAtEveryExtreme) {
  for (const double coat : {0., 1e-3, .5, 1e30})
    for (const double metal : {0., 1e-3, .5, 1e30})
      for (const double ior : {1e-3, 1.0000001, 1.5, 1e3})
        for (const auto& [eta, k] :
             {std::pair{Rgb{0, 1, 1.5}, Rgb{0, 0, 0}}, {Rgb{0, 1e30, 1}, Rgb{1e30, 0, 1}}}) {
          const auto b = bench(coated(coat, metal, .1 * metal, eta, k, ior));
          expect_finite(*b, {1., .5, 1e-3, 1e-7, 1e-20});
        }
}

TEST(CoatedConductor, RefusesInvalidRoughnessesAndIndices) {
  for (const auto& b : {CoatedConductorBsdf{.coat_alpha = -1}, CoatedConductorBsdf{.alpha_u = NAN},
                        CoatedConductorBsdf{.int_ior = 0}, CoatedConductorBsdf{.eta = {-1, 0, 0}}}) {
    Scene s = coated(0, .1, .1, kGoldEta, kGoldK);
    auto bad = b;
    bad.specular_reflectance = std::get<CoatedConductorBsdf>(s.bsdfs[0]).specular_reflectance;
    s.bsdfs[0] = bad;
    const auto textures = TextureTable::build(s, {});
    ASSERT_TRUE(textures);
    EXPECT_FALSE(BsdfTable::build(s, *textures));
  }
}

TEST(CoatedConductor, EqualOnesShareATable) {
  expect_equal_ones_share_tables(coated(.23, .23, .23, kGoldEta, kGoldK));
}

}  // namespace
}  // namespace ls::render::test
