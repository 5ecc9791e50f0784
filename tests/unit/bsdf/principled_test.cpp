// The principled material: closed forms, symmetries and edge cases. Its values are tested in
// mitsuba_values_test.cpp, its sampling in sampling_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/bsdf/materials.h"

namespace ls::render::test {
namespace {

const V3 kAbove(0, 0, 1), kBelow(0, 0, -1);

// At normal incidence the diffuse lobe is base / pi, because the retro-reflection is 0 there. The facets have
// F0 = ((n - 1) / (n + 1))^2, D = 1 / (pi alpha^2) and alpha = roughness^2.
TEST(Principled, NormalIncidenceHasTheHandComputedValue) {
  const auto b = bench(principled({.roughness = .6}));
  const double D = 1 / (M_PI * std::pow(.36, 2));
  EXPECT_NEAR(b->eval(kAbove, kAbove).f_cos.x, .8 / M_PI + .04 * D / 4, 1e-6);
  EXPECT_NEAR(b->eval(kAbove, kAbove).f_cos.z, .1 / M_PI + .04 * D / 4, 1e-6);
  const auto metal = bench(principled({.roughness = .6, .metallic = 1}));
  EXPECT_NEAR(metal->eval(kAbove, kAbove).f_cos.y, .4 * D / 4, 1e-6) << "a metal reflects its colour";
  EXPECT_EQ(b->eval(kBelow, kBelow).f_cos, C3(0));
  EXPECT_FALSE(b->sample(kBelow, .3f, {.1f, .2f})) << "without spec_trans it has one side";
}

TEST(Principled, FullTransmissionIsRoughGlassWithTheRootOfItsColour) {
  const Rgb root{std::sqrt(.8), std::sqrt(.4), std::sqrt(.1)};
  const auto b = bench(principled({.roughness = .5, .spec_trans = 1, .eta = 1.5}));
  const auto glass = bench(rough_glass(Microfacet::ggx, .25, .25, 1.5, 1, {1, 1, 1}, root));
  for (const double mu : {.9, .3, -.3, -.8})
    for (const double nu : {.8, .2, -.4, -.95}) {
      const V3 wo = direction(mu, 1), wi = direction(nu, 3.5);
      const BsdfEval e = b->eval(wo, wi), g = glass->eval(wo, wi);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(e.f_cos[c], g.f_cos[c], 1e-5 * g.f_cos[c]) << mu << " " << nu;
      EXPECT_NEAR(e.pdf, g.pdf, 1e-5 * g.pdf) << mu << " " << nu;
    }
}

// Along a path, radiance divided by the square of the index is conserved.
TEST(Principled, IsReciprocal) {
  for (const PrincipledValues& v :
       {PrincipledValues{}, metal_values(), cloth_values(), glass_values(), all_values()}) {
    const auto b = bench(principled(v));
    int lit = 0;
    for (const double mu : {.95, .6, .2, -.1, -.5, -.9})
      for (const double nu : {.9, .35, -.3, -.85}) {
        const V3 a = direction(mu, .3), c = direction(nu, 2.9);
        const double square_a = a.z > 0 ? 1 : v.eta * v.eta, square_c = c.z > 0 ? 1 : v.eta * v.eta;
        const double ac = b->eval(a, c).f_cos.y / std::abs(c.z) / square_a,
                     ca = b->eval(c, a).f_cos.y / std::abs(a.z) / square_c;
        // The half vector is rounded by 1e-7 of |wo + eta wi| >= eta - 1; slopes are divided by alpha >= .09.
        EXPECT_NEAR(ac, ca, 1e-4 * ac) << mu << " " << nu;
        lit += ac > 0;
      }
    EXPECT_GE(lit, v.spec_trans > 0 ? 14 : 6);
  }
}

double albedo(const Bench& b, const V3& wo, bool sampled) {
  constexpr int kSide = 64;
  double sum = 0;
  if (sampled) {
    for (int l = 0; l < 64; ++l)
      for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j)
          if (const auto s = b.sample(wo, (l + .5f) / 64, {(i + .5f) / kSide, (j + .5f) / kSide}))
            sum += s->weight.x;
    return sum / 64 / kSide / kSide;
  }
  constexpr int kTheta = 2000, kPhi = 500;
  for (int i = 0; i < kTheta; ++i)
    for (int j = 0; j < kPhi; ++j) {
      const double theta = M_PI * (i + .5) / kTheta;
      sum += b.eval(wo, direction(std::cos(theta), 2 * M_PI * (j + .5) / kPhi)).f_cos.x * std::sin(theta);
    }
  return sum * M_PI / kTheta * 2 * M_PI / kPhi;
}

// The mean weight of samples must be the integral of the values. The tolerance of 5e-3 is for both grids near
// grazing directions, and in the coat's lobe (alpha .07), which is .02 rad wide, while the 64 points per axis
// of the random numbers are 1/64 apart.
TEST(Principled, SamplesReproduceTheIntegral) {
  for (const PrincipledValues& v :
       {PrincipledValues{}, metal_values(), cloth_values(), glass_values(), all_values()})
    for (const double mu : {.95, .4, -.5}) {
      const auto b = bench(principled(v));
      EXPECT_NEAR(albedo(*b, direction(mu, 1), true), albedo(*b, direction(mu, 1), false), 5e-3) << mu;
    }
}

// Facets without other lobes only lose light, by masking: the reflectances of Fresnel and Schlick are at most
// 1.
TEST(Principled, MetalAndGlassNeverReflectMoreThanTheyReceive) {
  for (const double roughness : {.05, .3, 1.})
    for (const double mu : {1., .5, .05}) {
      const V3 wo = direction(mu, 1);
      EXPECT_LE(albedo(*bench(principled({.roughness = roughness, .metallic = 1}, {1, 1, 1})), wo, true),
                1 + 1e-4);
      const auto glass = bench(principled({.roughness = roughness, .spec_trans = 1}, {1, 1, 1}));
      double sum = 0;
      for (int i = 0; i < 4096; ++i)
        if (const auto s =
                glass->sample(wo, (i % 16 + .5f) / 16, {(i / 16 % 16 + .5f) / 16, (i / 256 + .5f) / 16}))
          sum += s->weight.x * sqr(s->eta);
      EXPECT_LE(sum / 4096, 1 + 1e-4);
    }
}

TEST(Principled, StaysFiniteAtEveryExtreme) {
  for (const double roughness : {0., .03, 1.})
    for (const double trans : {0., .5, 1.})
      for (const double eta : {1e-2, 1., 1.0005, 3., 100.}) {
        const auto b = bench(principled({.roughness = roughness,
                                         .anisotropic = 1,
                                         .metallic = .1,
                                         .spec_trans = trans,
                                         .eta = eta,
                                         .spec_tint = 1,
                                         .sheen = 1,
                                         .sheen_tint = 1,
                                         .flatness = 1,
                                         .clearcoat = 1,
                                         .clearcoat_gloss = 1},
                                        {0, 0, 0}));
        expect_finite(*b, {1., .5, 1e-3, 1e-20, -1e-20, -1e-3, -.7, -1.});
      }
}

TEST(Principled, ReportsItsNeeds) {
  const auto plain = bench(principled({})), stretched = bench(principled({.anisotropic = .1}));
  EXPECT_FALSE(plain->bsdfs.reads_uv({0}) || plain->bsdfs.anisotropic({0}) || passes_light(*plain));
  EXPECT_TRUE(stretched->bsdfs.anisotropic({0}) && plain->bsdfs.has_smooth({0}));
}

}  // namespace
}  // namespace ls::render::test
