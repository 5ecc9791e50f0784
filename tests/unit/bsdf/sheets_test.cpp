// Thin sheets: diffuse ones, such as leaves, and rough panes of glass.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render::test {
namespace {

V3 mirrored_below(const V3& w) { return {w.x, w.y, -w.z}; }

void expect_colour(const C3& got, const C3& wanted) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], wanted[c], 3e-7f * std::abs(wanted[c]));
}

TEST(DiffuseTransmission, ReflectsOnTheSideOfTheViewerAndTransmitsToTheOther) {
  const auto b = bench(leaf({.1, .2, .3}, {.6, .4, .2}));
  const C3 R(.1f, .2f, .3f), T(.6f, .4f, .2f);
  for (const double side : {1., -1.})
    for (const double mu : {.9, .2}) {
      const V3 wo = direction(side * mu, 1);
      expect_colour(b->eval(wo, direction(side * .5, 4)).f_cos, R * (.5f * kInvPi));
      expect_colour(b->eval(wo, direction(side * -.5, 4)).f_cos, T * (.5f * kInvPi));
    }
  EXPECT_EQ(b->eval({1, 0, 0}, {0, 0, 1}).pdf, 0);
  EXPECT_EQ(b->eval({0, 0, 1}, {1, 0, 0}).pdf, 0);
}

TEST(DiffuseTransmission, PassesNoLightStraightOn) {
  const auto b = bench(leaf({.1, .2, .3}, {.6, .4, .2}));
  EXPECT_TRUE(b->bsdfs.has_smooth(b->bsdf));
  EXPECT_FALSE(passes_light(*b));
}

// Reflectance and transmittance that add up to more than 1 are scaled to 1. The reader refuses such
// constants, but cannot check images.
TEST(DiffuseTransmission, SumAboveOneIsScaledToOne) {
  const auto constant = bench(leaf({.9, .5, .25}, {.9, .5, .25}));
  Scene s = leaf({1, 1, 1}, {1, 1, 1});
  s.textures.push_back(CheckerboardTexture{texture(s, Rgb{.9, .5, .25}), texture(s, Rgb{.9, .5, .25}), {}});
  const TextureIndex board{static_cast<std::uint32_t>(s.textures.size() - 1)};
  s.bsdfs.back() = DiffuseTransmissionBsdf{board, board};
  const auto textured = bench(std::move(s));

  for (const Bench* b : {constant.get(), textured.get()})
    for (const double to : {1., -1.})
      expect_colour(b->eval({0, 0, 1}, {0, 0, static_cast<float>(to)}).f_cos, C3(.5f, .5f, .25f) * kInvPi);
}

// The transmitted value over 1 - R is the reflected value over R for the direction mirrored at the sheet, on
// both sides.
TEST(RoughSheet, TransmitsTheMirroredLobeOfItsReflection) {
  for (const auto d : {Microfacet::ggx, Microfacet::beckmann}) {
    const auto b = bench(rough_sheet(d, .5, .2, 1.5));
    for (const double side : {1., -1.})
      for (const double mu : {.95, .6, .15})
        for (const double phi : {0., 1., 3.})
          for (const double mi : {.9, .4}) {
            const V3 wo = direction(side * mu, .3), wi = direction(side * mi, phi);
            const V3 m = normalize(wo + wi);
            const double r = fresnel_dielectric(double{dot(wo, m)}, 1.5).reflectance, R = 2 * r / (1 + r);
            const double back = double{b->eval(wo, wi).f_cos.x} / R,
                         through = double{b->eval(wo, mirrored_below(wi)).f_cos.x} / (1 - R);
            // R is a float32 with an error of at most 2^-24, relative to R >= 2 * .04 / 1.04 = .077.
            EXPECT_NEAR(through, back, 2e-6 * back);
            EXPECT_NEAR(b->eval(wo, wi).pdf / R, b->eval(wo, mirrored_below(wi)).pdf / (1 - R), 2e-6 / R);
          }
  }
}

struct Shares {
  double back = 0, through = 0;
  // The mean angle [rad] between the samples and the directions of a smooth sheet
  double farthest = 0;
};
Shares shares(const Bench& b, const V3& wo) {
  constexpr int kPoints = 256;
  Shares s;
  double off = 0;
  int n = 0;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      const float u = (i + .5f) / kPoints, v = (j + .5f) / kPoints;
      const float lobe = static_cast<float>(std::fmod((i * kPoints + j + .5) * .6180339887498949, 1));
      const auto one = b.sample(wo, lobe, {u, v});
      if (!one) continue;
      (one->transmitted ? s.through : s.back) += double{one->weight.y};
      const V3 smooth = one->transmitted ? -wo : V3(-wo.x, -wo.y, wo.z);
      off += double{std::sqrt(dot(one->wi - smooth, one->wi - smooth))};
      ++n;
    }
  s.back /= kPoints * kPoints;
  s.through /= kPoints * kPoints;
  s.farthest = off / n;
  return s;
}

// The shares differ from those of a smooth sheet by R' alpha tan, because facets are tilted by about alpha,
// and by masking, which is of the order of alpha^2. The choice of the lobe by a lattice of 65,536 samples has
// an error of some 1e-4.
TEST(RoughSheet, ConvergesToTheSmoothSheet) {
  for (const auto d : {Microfacet::ggx, Microfacet::beckmann})
    for (const double mu : {1., .8, .5, -.7}) {
      const V3 wo = direction(mu, 1);
      const double r = fresnel_dielectric(std::abs(mu), 1.5).reflectance, R = 2 * r / (1 + r);
      for (const double alpha : {.02, .004, .0011}) {
        const Shares s = shares(*bench(rough_sheet(d, alpha, alpha, 1.5)), wo);
        EXPECT_NEAR(s.back, R, .1 * alpha + 3e-4) << alpha << " " << mu;
        EXPECT_NEAR(s.through, 1 - R, .1 * alpha + 3e-4) << alpha << " " << mu;
        EXPECT_LT(s.farthest, 4 * alpha) << alpha << " " << mu;
        EXPECT_GT(s.farthest, .5 * alpha) << alpha << " " << mu;
      }
    }
}

TEST(RoughSheet, BelowTheSpecularLimitItIsTheSmoothSheet) {
  const auto smooth = bench(thin_glass(1.5, {.9, .8, .7}, {.5, .6, .7})),
             rough = bench(rough_sheet(Microfacet::ggx, 9e-4, 5e-4, 1.5, {.9, .8, .7}, {.5, .6, .7}));
  // The same roughness from a texture.
  Scene s = rough_sheet(Microfacet::ggx, 1, 1, 1.5, {.9, .8, .7}, {.5, .6, .7});
  s.textures.push_back(CheckerboardTexture{texture(s, 5e-4), texture(s, 5e-4), {}});
  const TextureIndex board{static_cast<std::uint32_t>(s.textures.size() - 1)};
  auto& b = std::get<RoughThinDielectricBsdf>(s.bsdfs.back());
  b.alpha_u = b.alpha_v = board;
  const auto textured = bench(std::move(s));

  for (const Bench* one : {rough.get(), textured.get()})
    for (const double mu : {.9, .3, -.6}) {
      const V3 wo = direction(mu, 2);
      EXPECT_TRUE(passes_light(*one));
      const auto passes = one->bsdfs.null_transmission(one->bsdf, one->at, wo),
                 wanted = smooth->bsdfs.null_transmission(smooth->bsdf, smooth->at, wo);
      EXPECT_EQ(passes.transmission, wanted.transmission);
      EXPECT_EQ(passes.probability, wanted.probability);
      const auto got = one->sample(wo, .5f, {.3f, .4f}), as = smooth->sample(wo, .5f, {.3f, .4f});
      ASSERT_TRUE(got && as);
      EXPECT_TRUE(got->delta);
      EXPECT_EQ(got->wi, as->wi);
      EXPECT_EQ(got->weight, as->weight);
      EXPECT_EQ(one->eval(wo, got->wi).pdf, 0);
    }
}

TEST(RoughSheet, PassesNoLightStraightOn) {
  const auto constant = bench(rough_sheet(Microfacet::ggx, .3, .3, 1.5));
  EXPECT_FALSE(passes_light(*constant));
  EXPECT_EQ(constant->bsdfs.null_transmission(constant->bsdf, constant->at, {0, 0, 1}).probability, 0);
}

// With compensation for multiple scattering a white sheet loses no light. Without it, it loses as much as a
// rough mirror, whatever its index.
TEST(RoughSheet, WhiteGlassSheetLosesNoMoreThanAMirror) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx})
    for (const double alpha : {.01, .1, .5, 1.})
      for (const double mu : {1., .7, .25, .03, -.6}) {
        const V3 wo = direction(mu, .3);
        Scene white = rough_sheet(d, alpha, alpha, 1.5);
        const auto plain = bench(white);
        std::get<RoughThinDielectricBsdf>(white.bsdfs.back()).multiple_scattering = true;
        const auto [all, error] = sampled_albedo(*bench(white), wo, 40000);
        EXPECT_NEAR(all, 1, kEnergyTolerance + 5 * error) << alpha << " " << mu;
        const auto kept = sampled_albedo(*plain, wo, 40000);
        const double mirror = 1 / double{conductor_energy(d, static_cast<double>(static_cast<float>(alpha)))
                                             .factor(static_cast<float>(std::abs(mu)), C3(1))
                                             .x};
        EXPECT_NEAR(kept.mean, mirror, kEnergyTolerance + 5 * kept.error) << alpha << " " << mu;
      }
}

}  // namespace
}  // namespace ls::render::test
