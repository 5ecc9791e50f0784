// Materials that scatter to both sides, let light pass, or contain others: closed forms, symmetries and edge
// cases.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/unit/bsdf/materials.h"
#include "validation/fixtures/fixtures.h"
#include "worker/render/bsdf/fresnel.h"

namespace ls::render::test {
namespace {

using cases::walsh;
using testing::HasSubstr;

const V3 kUp(0, 0, 1), kDown(0, 0, -1);

TEST(Plastic, InternalReflectanceIsTheClosedForm) {
  for (const double n : {1.1, 1.33, 1.5, 1.9, 3.}) {
    EXPECT_NEAR(internal_diffuse_reflectance(n), 1 - (1 - walsh(n)) / (n * n), 1e-6) << n;
    EXPECT_NEAR(internal_diffuse_reflectance(1 / n), walsh(n), 1e-6) << n;
  }
  EXPECT_EQ(internal_diffuse_reflectance(1), 0);
}

TEST(Plastic, BaseIsAttenuatedTwiceByTheCoat) {
  const double n = 1.5, r = 1 - (1 - walsh(n)) / (n * n), through = .96 * .96 / (n * n) / M_PI;
  const auto linear = bench(plastic(1.5, 1, false, {.2, .5, .8}));
  const auto nonlinear = bench(plastic(1.5, 1, true, {.2, .5, .8}));
  EXPECT_NEAR(linear->eval(kUp, kUp).f_cos.y, through * .5 / (1 - r), 1e-6);
  EXPECT_NEAR(nonlinear->eval(kUp, kUp).f_cos.y, through * .5 / (1 - .5 * r), 1e-6);
  EXPECT_EQ(linear->eval(kDown, kDown).f_cos, C3(0));
  EXPECT_FALSE(linear->sample(kDown, .1f, {.1f, .2f}));
  const auto coat = linear->sample(kUp, 0, {.1f, .2f});
  ASSERT_TRUE(coat && coat->delta);
  EXPECT_NEAR(coat->weight.x * coat->pdf, .04, 1e-7);
}

TEST(RoughDielectric, NormalIncidenceHasTheHandComputedValue) {
  // With m = z, D = 1 / (pi alpha^2) and G = 1 the reflected value is F D / 4, and the refracted one (1 - F)
  // D / (1 - n)^2 (its density has the additional factor n^2).
  const double a = .3, D = 1 / (M_PI * a * a);
  const auto b = bench(rough_glass(Microfacet::ggx, a, a, 1.5, 1, {1, .5, 1}, {1, .25, 1}));
  const BsdfEval up = b->eval(kUp, kUp), down = b->eval(kUp, kDown), out = b->eval(kDown, kUp);
  EXPECT_NEAR(up.f_cos.x, .04 * D / 4, 1e-6);
  EXPECT_NEAR(up.f_cos.y, .02 * D / 4, 1e-6);
  EXPECT_NEAR(up.pdf, .04 * D / 4, 1e-6);
  EXPECT_NEAR(down.f_cos.x, .96 * D / .25, 1e-4);
  EXPECT_NEAR(down.f_cos.y, .24 * D / .25, 1e-4);
  EXPECT_NEAR(down.pdf, .96 * D * 2.25 / .25, 1e-4);
  EXPECT_NEAR(out.f_cos.x, .96 * D / sqr(1 - 1 / 1.5), 1e-4);
}

// Along a path, radiance divided by the square of the index is conserved.
TEST(RoughDielectric, IsReciprocalUpToTheSquareOfTheIndex) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx}) {
    const double n = 1.5;
    const auto b = bench(rough_glass(d, .5, .2, n, 1));
    int lit = 0;
    for (const double mu : {.95, .6, .2, -.1, -.5, -.9})
      for (const double nu : {.9, .35, -.3, -.85}) {
        const V3 a = direction(mu, .3), c = direction(nu, 2.9);
        const double square_a = a.z > 0 ? 1 : n * n, square_c = c.z > 0 ? 1 : n * n;
        const double ac = b->eval(a, c).f_cos.y / std::abs(c.z) / square_a,
                     ca = b->eval(c, a).f_cos.y / std::abs(a.z) / square_c;
        // The half vector is rounded by 1e-7 of |wo + eta wi| >= n - 1; slopes are divided by alpha >= .2.
        EXPECT_NEAR(ac, ca, 1e-4 * ac) << mu << " " << nu;
        lit += ac > 0;
      }
    EXPECT_GE(lit, 16);
  }
}

TEST(RoughDielectric, ConvergesToTheSmoothDielectric) {
  const auto smooth = bench(glass(1.5, 1));
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx}) {
    const auto rough = bench(rough_glass(d, 1.5e-3, 1.5e-3, 1.5, 1));
    EXPECT_TRUE(rough->bsdfs.has_smooth(rough->bsdf));
    for (const double mu : {.9, .5, -.9})
      for (const float lobe : {1e-4f, .5f}) {
        const auto s = smooth->sample(direction(mu, 1), lobe, {.5f, .5f});
        for (const float v : {.1f, .5f, .9f}) {
          const auto r = rough->sample(direction(mu, 1), lobe, {.3f, v});
          ASSERT_TRUE(s && r);
          EXPECT_EQ(r->transmitted, s->transmitted);
          EXPECT_EQ(r->eta, s->eta);
          EXPECT_NEAR((r->wi - s->wi).length(), 0,
                      // The slope is up to 3 alpha, and refraction turns directions by up to 3 times as much
                      3 * 3 * 1.5e-3);
          EXPECT_NEAR(r->weight.x, s->weight.x, 1e-3);
        }
      }
    for (const double ior : {1.0005, 1.})  // deflection is negligible
      EXPECT_FALSE(bench(rough_glass(d, .3, .3, ior, 1))->bsdfs.has_smooth({0}));
    EXPECT_FALSE(bench(rough_glass(d, 9e-4, 9e-4, 1.5, 1))->bsdfs.has_smooth({0}));
  }
}

TEST(RoughDielectric, StaysFiniteAtEveryExtreme) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx})
    for (const double alpha : {1e-3, 1e-2, 1., 10.})
      for (const double ior : {1.002, 1.5, 100.}) {
        const auto b = bench(rough_glass(d, alpha, alpha, ior, 1));
        expect_finite(*b, {1., .5, 1e-3, 1e-20, -1e-20, -1e-3, -.7, -1.});
      }
}

TEST(ThinDielectric, MatchesASheetOfTwoInterfaces) {
  const auto b = bench(thin_glass(1.5, {1, .5, 1}, {1, 1, .25}));
  const double R = 2 * .04 / 1.04;
  for (const V3& w : {kUp, kDown}) {
    const NullTransmission v = b->bsdfs.null_transmission(b->bsdf, {0, 0}, w);
    EXPECT_NEAR(v.probability, 1 - R, 1e-7);
    EXPECT_NEAR(v.transmission.x, 1 - R, 1e-7);
    EXPECT_NEAR(v.transmission.z, .25 * (1 - R), 1e-7);
    const auto s = b->sample(w, .9f, {.3f, .3f});
    ASSERT_TRUE(s && s->delta && !s->transmitted);
    EXPECT_EQ(s->wi, w);
    EXPECT_NEAR(s->weight.x, R, 1e-7);
    EXPECT_NEAR(s->weight.y, R / 2, 1e-7);
  }
  EXPECT_EQ(bench(thin_glass(1))->bsdfs.null_transmission({0}, {0, 0}, direction(.3, 1)).probability, 1);
  EXPECT_EQ(bench(thin_glass(1.5))->bsdfs.null_transmission({0}, {0, 0}, V3(1, 0, 0)).probability, 0)
      << "grazing: a mirror";
}

TEST(Mask, PassesTheRestOfTheLight) {
  const auto bare = bench(diffuse({.2, .5, .9})), b = bench(masked(diffuse({.2, .5, .9}), .25));
  EXPECT_TRUE(passes_light(*b) && b->bsdfs.has_smooth(b->bsdf));
  EXPECT_FALSE(passes_light(*bare));
  EXPECT_EQ(b->bsdfs.null_transmission(b->bsdf, {0, 0}, kUp).transmission, C3(.75f));
  EXPECT_EQ(b->bsdfs.null_transmission(b->bsdf, {0, 0}, kDown).probability, .75f);
  EXPECT_EQ(b->eval(kUp, kUp).f_cos, bare->eval(kUp, kUp).f_cos * .25f);
  EXPECT_EQ(b->eval(kUp, kUp).pdf, bare->eval(kUp, kUp).pdf);
  EXPECT_EQ(b->sample(kUp, .3f, {.2f, .8f})->weight.x, .05f);

  // Half of the surface is a sheet of glass.
  const auto sheet = bench(masked(thin_glass(1.5), .5));
  EXPECT_NEAR(sheet->bsdfs.null_transmission(sheet->bsdf, {0, 0}, kUp).transmission.x,
              1 - .5 * 2 * .04 / 1.04, 1e-7);
  EXPECT_FALSE(sheet->bsdfs.has_smooth(sheet->bsdf));
}

TEST(Blend, EqualsTheWeightedMixture) {
  const Scene a = diffuse({.2, .5, .9}), b = rough_metal(Microfacet::ggx, .3, .1, kGoldEta, kGoldK);
  const auto first = bench(a), second = bench(b), mixed = bench(blend(a, b, .25));
  EXPECT_TRUE(mixed->bsdfs.anisotropic(mixed->bsdf));
  const V3 wo = direction(.7, 1), wi = direction(.4, 3);
  const BsdfEval e = mixed->eval(wo, wi), f = first->eval(wo, wi), s = second->eval(wo, wi);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(e.f_cos[c], .75f * f.f_cos[c] + .25f * s.f_cos[c], 1e-6f * e.f_cos[c]);
  EXPECT_NEAR(e.pdf, .75f * f.pdf + .25f * s.pdf, 1e-6f * e.pdf);
  EXPECT_EQ(bench(blend(a, b, 0))->eval(wo, wi).f_cos, f.f_cos);
  EXPECT_EQ(bench(blend(a, b, 1))->eval(wo, wi).f_cos, s.f_cos);
  EXPECT_TRUE(bench(blend(a, b, 1))->sample(wo, .999f, {.2f, .3f}));
  EXPECT_TRUE(bench(blend(a, b, 0))->sample(wo, 0, {.2f, .3f}));
}

TEST(Blend, SamplesAMirrorInProportionToItsWeight) {
  Scene mirror;
  add(mirror, ConductorBsdf{{0, 0, 0}, {1, 1, 1}, texture(mirror, 1)});
  const auto b = bench(blend(diffuse({.5, .5, .5}), mirror, .25));
  const auto m = b->sample(kUp, .2f, {.1f, .2f}), d = b->sample(kUp, .3f, {.1f, .2f});
  ASSERT_TRUE(m && d);
  EXPECT_TRUE(m->delta);
  EXPECT_FLOAT_EQ(m->pdf, .25f);
  EXPECT_NEAR(m->weight.x, 1, 1e-6);
  EXPECT_FALSE(d->delta);
  EXPECT_NEAR(d->weight.x, .5, 1e-6);
  EXPECT_FLOAT_EQ(d->pdf, .75f * b->eval(kUp, d->wi).pdf / .75f);
}

TEST(Blend, BlendWithABlackBranchSamplesTheOther) {
  Scene s;
  add(s, NullBsdf{});
  const auto b = bench(blend(s, diffuse({.5, .5, .5}), .25));
  EXPECT_EQ(b->bsdfs.null_transmission(b->bsdf, {0, 0}, kUp).probability, .75f);
  for (const float lobe : {0.f, .5f, .99f}) {
    const auto d = b->sample(kUp, lobe, {.1f, .2f});
    ASSERT_TRUE(d);
    EXPECT_NEAR(d->weight.x, .25f * .5f, 1e-7);
  }
}

TEST(Blend, TwoSidedBlendLooksTheSameFromBothSides) {
  const auto b = bench(
      two_sided(blend(diffuse({.2, .5, .9}), rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .5)));
  const V3 up = direction(.6, 1), up2 = direction(.8, 2), down = direction(-.6, 1), down2 = direction(-.8, 2);
  EXPECT_EQ(b->eval(up, up2).f_cos, b->eval(down, down2).f_cos);
  EXPECT_EQ(b->eval(up, down2).f_cos, C3(0));
  EXPECT_LT(b->sample(down, .1f, {.5f, .5f})->wi.z, 0);
}

TEST(NormalMap, ConstantMapOfTheNormalChangesNothing) {
  const Scene metal = rough_metal(Microfacet::ggx, .3, .1, kGoldEta, kGoldK);
  const auto bare = bench(metal), b = bench(turned(metal, kUp));
  EXPECT_TRUE(b->bsdfs.anisotropic(b->bsdf) && b->bsdfs.has_smooth(b->bsdf));
  EXPECT_FALSE(b->bsdfs.reads_uv(b->bsdf));
  const V3 wo = direction(.7, 1), wi = direction(.4, 3);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(b->eval(wo, wi).f_cos[c], bare->eval(wo, wi).f_cos[c], 1e-5f * bare->eval(wo, wi).f_cos[c]);
  EXPECT_NEAR((b->sample(wo, .5f, {.3f, .6f})->wi - bare->sample(wo, .5f, {.3f, .6f})->wi).length(), 0, 1e-5);
}

TEST(NormalMap, ChangesTheCosineOfADiffuseSurfaceAndTheDirectionOfAMirror) {
  const V3 n = direction(.8, 2);
  const auto b = bench(turned(diffuse({.5, .5, .5}), n));
  const V3 wi = direction(.9, 2.5);
  EXPECT_NEAR(b->eval(kUp, wi).f_cos.x, .5f * kInvPi * dot(n, wi), 1e-6);
  EXPECT_NEAR(b->eval(kUp, wi).pdf, kInvPi * dot(n, wi), 1e-6);
  // wi is above the surface but below the horizon of the mapped normal, and the reverse.
  EXPECT_EQ(b->eval(kUp, direction(.1, 2 + M_PI)).f_cos, C3(0));
  EXPECT_EQ(b->eval(kUp, direction(-.1, 2)).f_cos, C3(0));

  Scene mirror;
  add(mirror, ConductorBsdf{{0, 0, 0}, {1, 1, 1}, texture(mirror, 1)});
  const auto m = bench(turned(mirror, n))->sample(kUp, .5f, {.5f, .5f});
  ASSERT_TRUE(m);
  EXPECT_NEAR((m->wi - reflect(kUp, n)).length(), 0, 1e-6);
  EXPECT_FALSE(bench(turned(mirror, direction(.5, 2)))->sample(kUp, .5f, {.5f, .5f})) << "into the surface";
  const auto two = bench(two_sided(turned(mirror, n)))->sample(kDown, .5f, {.5f, .5f});
  ASSERT_TRUE(two);
  EXPECT_NEAR((two->wi - V3(m->wi.x, m->wi.y, -m->wi.z)).length(), 0, 1e-6);
}

TEST(NormalMap, RotatesTheDirectionsOfAnisotropy) {
  // The normal is turned about y: the tangent along u turns in the plane of x and z, and the other tangent
  // stays.
  const double a = .3;
  const V3 n(static_cast<float>(std::sin(a)), 0, static_cast<float>(std::cos(a))), s(n.z, 0, -n.x),
      t(0, 1, 0);
  const Scene metal = rough_metal(Microfacet::ggx, .4, .1, kGoldEta, kGoldK);
  const auto bare = bench(metal), b = bench(turned(metal, n));
  const V3 wo = direction(.8, 1), wi = direction(.7, 4);
  const auto local = [&](const V3& w) { return V3(dot(w, s), dot(w, t), dot(w, n)); };
  EXPECT_NEAR(b->eval(wo, wi).f_cos.x, bare->eval(local(wo), local(wi)).f_cos.x,
              1e-4 * bare->eval(local(wo), local(wi)).f_cos.x);
}

// Where the image is not mirrored, dp/du, dp/dv and the normal are left-handed, since v points down: the
// map's green then leans against dp/dv either way. Where it is mirrored, it does so with follow_mirroring
// alone.
TEST(NormalMap, FollowsAMirroredImageIfRequested) {
  const V3 n = direction(.8, .7);
  for (const bool follows : {false, true})
    for (const float dv : {-1.f, 1.f}) {
      Scene s = turned(diffuse({.5, .5, .5}), n);
      std::get<NormalMapBsdf>(s.bsdfs.back()).follow_mirroring = follows;
      const auto b = bench(s);
      EXPECT_EQ(b->bsdfs.reads_slopes(b->bsdf), follows);
      b->at.du = {2, 0, 0};
      b->at.dv = {.3f, dv, 0};
      const V3 leans(n.x, follows && dv > 0 ? -n.y : n.y, n.z), wi = direction(.9, 1.5);
      EXPECT_NEAR(b->eval(kUp, wi).f_cos.x, .5f * kInvPi * dot(leans, wi), 1e-6) << follows << dv;
    }
}

// As in Mitsuba 3.9.1: unscattered light is shadowed as reflected light would be, and there is none if the
// direction is on different sides of the surface and of the mapped normal.
TEST(NormalMap, AlsoShadowsLightThatPassesStraightOn) {
  const auto map = [](bool flips, bool shadows) {
    Scene s = masked(diffuse({.5, .5, .5}), .25);
    add(s, NormalMapBsdf{texture(s, Rgb{.85, .35, .75}), last(s), flips, shadows});  // (.7, -.3, .5)
    return bench(s);
  };
  const auto null_transmission = [](const Bench& b, const V3& w) {
    return b.bsdfs.null_transmission(b.bsdf, V2(0, 0), w);
  };
  const double slope2 = (.7 * .7 + .3 * .3) / (.5 * .5);
  for (const V3& w : {V3(.6f, 0, .8f), V3(-.6f, 0, -.8f)}) {
    const double lit = 2 / (1 + std::sqrt(1 + slope2 / 8 * sqr(.6 / .8)));
    EXPECT_EQ(null_transmission(*map(true, true), w).probability, .75f);
    EXPECT_NEAR(null_transmission(*map(true, true), w).transmission.y, .75 * lit, 1e-6);
    EXPECT_EQ(null_transmission(*map(true, false), w).transmission, C3(.75f));
    EXPECT_EQ(null_transmission(*map(false, false), w).transmission, C3(.75f));
  }
  const V3 away(-.8f, 0, .6f);
  EXPECT_EQ(null_transmission(*map(false, false), away).probability, 0);
  EXPECT_FALSE(map(false, false)->sample(away, .5f, {.3f, .6f}));
  EXPECT_EQ(null_transmission(*map(true, false), away).probability, .75f);
}

TEST(Nesting, FlagsDeriveFromTheParts) {
  Scene s = diffuse({.5, .5, .5});
  s.textures.push_back(CheckerboardTexture{{0}, {0}, {}});
  add(s, MaskBsdf{{1}, {0}});
  const auto b = bench(s);
  EXPECT_TRUE(b->bsdfs.reads_uv({1}));
  EXPECT_FALSE(b->bsdfs.reads_uv({0}));
  EXPECT_TRUE(bench(masked(rough_glass(Microfacet::ggx, .3, .1, 1.5, 1), .5))->bsdfs.anisotropic({1}));
  EXPECT_FALSE(bench(masked(rough_glass(Microfacet::ggx, .3, .3, 1.5, 1), .5))->bsdfs.reads_uv({1}));
}

TEST(Nesting, ImpossibleNestingIsRefused) {
  const auto error = [](const Scene& s) {
    auto t = TextureTable::build(s, [](const Asset&) { return fail(Errc::not_found, "no file"); });
    const auto b = BsdfTable::build(s, *t);
    return b ? std::string() : b.error().message;
  };
  EXPECT_THAT(error(two_sided(masked(diffuse({1, 1, 1}), .5))), HasSubstr("lets light through"));
  EXPECT_THAT(error(two_sided(rough_glass(Microfacet::ggx, .1, .1, 1.5, 1))),
              HasSubstr("lets light through"));
  Scene circle = diffuse({1, 1, 1});
  circle.bsdfs = {MaskBsdf{{0}, {1}}, BlendBsdf{{0}, {0}, {0}}};
  EXPECT_THAT(error(circle), HasSubstr("or itself"));
  circle.bsdfs = {MaskBsdf{{0}, {7}}};
  EXPECT_THAT(error(circle), HasSubstr("does not exist"));
  Scene deep = diffuse({1, 1, 1});
  for (int i = 0; i < 7; ++i) deep = masked(deep, .5);
  EXPECT_EQ(error(deep), "");
  EXPECT_THAT(error(masked(deep, .5)), HasSubstr("8 deep"));
}

}  // namespace
}  // namespace ls::render::test
