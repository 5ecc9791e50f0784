// Compensation of the light that scatters several times between microfacets: white furnaces, and what it must
// not change.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render::test {
namespace {

const double kAlphas[] = {0, 1e-3, .01, .1, .5, 1};
const std::pair<Microfacet, const char*> kDistributions[] = {{Microfacet::beckmann, "beckmann"},
                                                             {Microfacet::ggx, "ggx"}};

// Allows 5 standard errors, which are exceeded once in 1.7 million cases. They are small enough to show a
// loss of 2 %; single scattering loses up to 70 %.
void expect_white(const Bench& b, const V3& wo, double tolerance, const std::string& what) {
  const SampledAlbedo e = sampled_albedo(b, wo, 40000);
  EXPECT_NEAR(e.mean, 1, tolerance + 5 * e.error) << what << " at " << wo.z;
  EXPECT_LT(e.error, .006) << what << " at " << wo.z;
}

// Seen from above, single scattering by GGX facets of roughness 1 reflects 1 - ln 2 of the light.
TEST(MultipleScattering, WithoutItWhiteGgxOfRoughnessOneReflectsOneMinusLogTwo) {
  const auto b = bench(rough_metal(Microfacet::ggx, 1, 1, {0, 0, 0}, {1, 1, 1}));
  const SampledAlbedo e = sampled_albedo(*b, {0, 0, 1}, 40000);
  EXPECT_NEAR(e.mean, 1 - std::log(2.), 5 * e.error);
  static const Quadrature q = gauss_legendre(256);
  EXPECT_NEAR(rough_share(Way::mirrored, Microfacet::ggx, 1, 1, 1, q), 1 - std::log(2.), 1e-5);
}

// Tests the tables, and the quadrature behind them, against a quadrature with 16 times as many nodes.
TEST(MultipleScattering, TablesConserveEnergyWithinTolerance) {
  static const Quadrature fine = gauss_legendre(400);
  for (const auto& [d, name] : kDistributions)
    for (const double alpha : {1e-3, .01, .1, .5, 1.}) {
      const auto fit = [&, type = d](double mu) {
        const V3 w = direction(mu, 0);
        const auto a = static_cast<float>(alpha);
        return type == Microfacet::ggx
                   ? 1.
                   : double{beckmann::G1_over_cos(w, a, a)} / double{beckmann::exact_G1_over_cos(w, a, a)};
      };
      const double rough = double{static_cast<float>(alpha)};  // rounded as in materials
      const MicrofacetEnergy metal = conductor_energy(d, rough), glass = dielectric_energy(d, rough, 1.5);
      for (const double mu : {.97, .76, .74, .33, .03, 2e-3}) {
        const auto E = [&](Way way, double eta) {
          return fit(mu) * rough_share(way, d, rough, eta, mu, fine);
        };
        const auto c = static_cast<float>(mu);
        EXPECT_NEAR(E(Way::mirrored, 1) * metal.factor(c, C3(1)).x, 1, kEnergyTolerance)
            << name << alpha << " " << mu;
        for (const bool outside : {true, false}) {
          const double eta = outside ? 1.5 : 1 / 1.5;
          EXPECT_NEAR((E(Way::reflected, eta) + E(Way::refracted, eta)) * glass.factor(c, outside), 1,
                      kEnergyTolerance)
              << name << " " << alpha << " " << mu << " " << outside;
        }
      }
    }
}

TEST(MultipleScattering, WhiteMetalLosesNoEnergy) {
  for (const auto& [d, name] : kDistributions)
    for (const double alpha : kAlphas) {
      const auto b = bench(with_compensation(rough_metal(d, alpha, alpha, {0, 0, 0}, {1, 1, 1})));
      for (const double mu : {1., .75, .25, .03, 1e-3})
        expect_white(*b, direction(mu, .3), kEnergyTolerance, fmt::format("{} {}", name, alpha));
    }
}

TEST(MultipleScattering, WhiteDielectricLosesNoEnergyFromEitherSide) {
  for (const auto& [d, name] : kDistributions)
    for (const double alpha : kAlphas) {
      const auto b = bench(with_compensation(rough_glass(d, alpha, alpha, 1.5, 1)));
      for (const double mu : {1., .73, .25, .03})
        for (const double side : {1., -1.})
          expect_white(*b, direction(side * mu, .3), kEnergyTolerance, fmt::format("{} {}", name, alpha));
    }
}

TEST(MultipleScattering, WhitePlasticLosesNoEnergy) {
  for (const auto& [d, name] : kDistributions)
    for (const double alpha : kAlphas) {
      const auto b = bench(with_compensation(rough_plastic(d, alpha, 1.5, 1, true, {1, 1, 1})));
      for (const double mu : {1., .7, .25, .03, 1e-3})
        expect_white(*b, direction(mu, .3), 2 * kEnergyTolerance, fmt::format("{} {}", name, alpha));
    }
}

// A metal of the principled material, alone and blended with plastic as readers of other formats do, and its
// glass from both sides, for every roughness. Of a texture the tables are coarser.
Scene white_principled(double roughness, double spec_trans = 0) {
  return with_compensation(principled(
      {.roughness = roughness, .metallic = spec_trans > 0 ? 0. : 1., .spec_trans = spec_trans}, {1, 1, 1}));
}
// The last texture that the material reads as its roughness becomes an image of that value.
Scene with_textured_roughness(Scene s) {
  auto& b = std::get<PrincipledBsdf>(s.bsdfs.back());
  const Texture same = s.textures[b.roughness.value];
  s.textures.push_back(same);
  s.textures.push_back(CheckerboardTexture{b.roughness, last_texture(s), {}});
  b.roughness = last_texture(s);
  return s;
}

TEST(MultipleScattering, WhitePrincipledMetalLosesNoEnergy) {
  for (const double roughness : {0., .5, 1.})
    for (const double metallic : {0., .5, 1.}) {
      Scene s = with_compensation(
          rough_plastic(Microfacet::ggx, std::max(roughness * roughness, 1e-3), 1.5, 1, true, {1, 1, 1}));
      const BsdfIndex plastic = last(s);
      const Scene metal = white_principled(roughness);
      PrincipledBsdf one = std::get<PrincipledBsdf>(metal.bsdfs.back());
      for (TextureIndex* t :
           {&one.base_color, &one.roughness, &one.anisotropic, &one.metallic, &one.spec_tint, &one.sheen,
            &one.sheen_tint, &one.flatness, &one.clearcoat, &one.clearcoat_gloss})
        *t = texture(s, std::get<ConstantTexture>(metal.textures[t->value]).value);
      add(s, one);
      add(s, BlendBsdf{texture(s, metallic), plastic, last(s)});
      const auto b = bench(s);
      for (const double mu : {1., .25, .03})
        expect_white(*b, direction(mu, .3), 2 * kEnergyTolerance,
                     fmt::format("metallic {} of roughness {}", metallic, roughness));
    }
}

TEST(MultipleScattering, WhitePrincipledGlassLosesNoEnergyFromEitherSide) {
  for (const double roughness : {.3, 1.}) {
    const auto b = bench(white_principled(roughness, 1));
    for (const double mu : {1., .25, -.25, -1.})
      expect_white(*b, direction(mu, .3), kEnergyTolerance, fmt::format("glass {}", roughness));
  }
}

TEST(MultipleScattering, TexturedRoughnessLosesEnergyOnlyAtGrazingAngles) {
  for (const double roughness : {.11, .52, .98}) {
    const auto metal = bench(with_textured_roughness(white_principled(roughness))),
               glass = bench(with_textured_roughness(white_principled(roughness, 1)));
    for (const double mu : {1., .25, .1}) {
      const std::string what = fmt::format("of roughness {}", roughness);
      expect_white(*metal, direction(mu, .3), kTexturedEnergyTolerance, "metal " + what);
      for (const double side : {1., -1.})
        expect_white(*glass, direction(side * mu, .3), kTexturedEnergyTolerance, "glass " + what);
    }
  }
}

TEST(MultipleScattering, IsRefusedForAnisotropicPrincipledMaterials) {
  const Scene s = with_compensation(principled({.anisotropic = .3, .metallic = 1}));
  const auto textures =
      TextureTable::build(s, [](const Asset&) -> Result<ImageData> { return fail(Errc::not_found, ""); });
  ASSERT_TRUE(textures);
  const auto table = BsdfTable::build(s, *textures);
  ASSERT_FALSE(table);
  EXPECT_NE(table.error().message.find("without anisotropic"), std::string::npos);
}

// A metal that absorbs gains less from compensation than a white one, whether by its tint or by its index.
// `gain` is summed as a series, in which each further bounce has the factor F (1 - E_mean).
TEST(MultipleScattering, MetalGainsByItsOwnReflectance) {
  const MicrofacetEnergy e = conductor_energy(Microfacet::ggx, .8);
  const float mu = .6f, missing = e.missing.at(mu), E = 1 / (1 + missing);
  double last = 0;
  for (const float F : {0.f, .2f, .5f, .9f, 1.f}) {
    double gain = 0, term = double{1} - E;
    for (int bounce = 0; bounce < 200; ++bounce, term *= double{F} * (1 - e.mean)) gain += term * F * e.mean;
    EXPECT_NEAR((e.factor(mu, C3(F)).x - 1) * E, gain, 1e-6) << F;
    EXPECT_GE(gain, last);
    last = gain;
  }
  const auto gold = bench(rough_metal(Microfacet::ggx, .8, .8, kGoldEta, kGoldK)),
             more = bench(with_compensation(rough_metal(Microfacet::ggx, .8, .8, kGoldEta, kGoldK)));
  const V3 wo = direction(.6, 0), wi = direction(.7, 2);
  const C3 before = gold->eval(wo, wi).f_cos, after = more->eval(wo, wi).f_cos;
  EXPECT_GT(after.x / before.x, after.y / before.y);
  EXPECT_GT(after.y / before.y, after.z / before.z);
  EXPECT_GT(after.z, before.z);
}

// Compensation changes only values. Samples and their densities stay the same, so tests of them without
// compensation apply.
TEST(MultipleScattering, DoesNotChangeSampling) {
  const Scene all[] = {rough_metal(Microfacet::ggx, .4, .4, kGoldEta, kGoldK),
                       rough_glass(Microfacet::beckmann, .3, .3, 1.5, 1),
                       principled({.roughness = .6, .metallic = .7}),
                       principled({.roughness = .6, .metallic = .2, .spec_trans = .6})};
  for (const Scene& s : all) {
    const auto plain = bench(s), more = bench(with_compensation(s));
    for (const double mu : {.9, .3, -.4})
      for (int i = 0; i < 50; ++i) {
        const float u = (i + .5f) / 50;
        const V3 wo = direction(mu, 1);
        const auto a = plain->sample(wo, u, {u, 1 - u}), b = more->sample(wo, u, {u, 1 - u});
        ASSERT_EQ(a.has_value(), b.has_value());
        if (!a) continue;
        EXPECT_EQ(a->wi, b->wi);
        EXPECT_EQ(a->pdf, b->pdf);
        EXPECT_EQ(plain->eval(wo, a->wi).pdf, more->eval(wo, a->wi).pdf);
        const C3 f = more->eval(wo, b->wi).f_cos;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(b->weight[c] * b->pdf, f[c], 1e-3f * f[c]);
      }
  }
}

TEST(MultipleScattering, IsRefusedForTexturedOrUnequalRoughness) {
  Scene s = rough_metal(Microfacet::ggx, .4, .3, kGoldEta, kGoldK);
  const TextureTable none;
  for (const bool textured : {false, true}) {
    auto& b = std::get<RoughConductorBsdf>(s.bsdfs.back());
    b.multiple_scattering = true;
    if (textured) {
      s.textures.push_back(CheckerboardTexture{{0}, {1}, {}});
      b.alpha_u = b.alpha_v = {static_cast<std::uint32_t>(s.textures.size() - 1)};
    }
    const auto textures =
        TextureTable::build(s, [](const Asset&) -> Result<ImageData> { return fail(Errc::not_found, ""); });
    ASSERT_TRUE(textures);
    const auto table = BsdfTable::build(s, *textures);
    ASSERT_FALSE(table);
    EXPECT_NE(table.error().message.find("multiple_scattering needs one roughness"), std::string::npos);
  }
}

TEST(MultipleScattering, TablesAreWithinTheirStatedError) {
  const auto f = [](double x) { return std::sqrt(x) + (x > .3 ? .2 * (x - .3) : 0); };
  const CosineTable t(f, 1e-3);
  for (int i = 0; i <= 5000; ++i) {
    const double x = i / 5000.;
    EXPECT_NEAR(t.at(static_cast<float>(x)), f(x), x > 1e-4 ? 1.1e-3 : 2e-3) << x;
  }
  // The mean is 2 int x (sqrt x + .2 max(0, x - .3)) dx
  EXPECT_NEAR(t.mean(), .8 + 2 * .2 * ((1 - .027) / 3 - .3 * (1 - .09) / 2), 1e-3);
  EXPECT_LT(t.bytes(), 4096u);
}

}  // namespace
}  // namespace ls::render::test
