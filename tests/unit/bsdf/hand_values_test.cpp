// Compares BSDFs with closed forms, and tests symmetries and edge cases.
#include <gmock/gmock.h>

#include <limits>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"

namespace ls::render::test {
namespace {

using testing::HasSubstr;

TEST(Fresnel, GivesTheTextbookValues) {
  EXPECT_NEAR(fresnel_dielectric(1, 1.5).reflectance, .04, 1e-15);
  EXPECT_NEAR(fresnel_dielectric(-1, 1.5).reflectance, .04, 1e-15);
  EXPECT_EQ(fresnel_dielectric(0, 1.5).reflectance, 1);
  const double brewster = std::cos(std::atan(1.5));  // only s-polarised light: r_s = -(n^2 - 1) / (n^2 + 1)
  EXPECT_NEAR(fresnel_dielectric(brewster, 1.5).reflectance, .5 * sqr(1.25 / 3.25), 1e-14);
  const double critical = std::sqrt(1 - 1 / 2.25);
  EXPECT_EQ(fresnel_dielectric(-critical * .999, 1.5).reflectance, 1);
  EXPECT_LT(fresnel_dielectric(-critical * 1.001, 1.5).reflectance, 1);
}

TEST(Fresnel, ZeroRealIndexReflectsEverything) {
  for (const float c : {0.f, 1e-7f, .3f, 1.f}) EXPECT_NEAR(fresnel_conductor(c, 0, 1), 1, 3e-7f) << c;
  for (const float c : {0.f, .5f, 1.f}) EXPECT_TRUE(std::isfinite(fresnel_conductor(c, 0, 0))) << c;
  // Normal incidence: ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2).
  EXPECT_NEAR(fresnel_conductor(1, .14f, 3.98f), (sqr(.86) + sqr(3.98)) / (sqr(1.14) + sqr(3.98)), 1e-6);
}

TEST(Dielectric, RefractsBySnellAndScalesRadianceByEtaSquared) {
  const auto b = bench(glass(1.5, 1));
  const V3 wo = direction(.6, 0);

  const auto in = b->sample(wo, .999f, {.5f, .5f});
  ASSERT_TRUE(in);
  EXPECT_TRUE(in->delta && in->transmitted);
  EXPECT_NEAR(in->wi.x, -.8f / 1.5f, 1e-6f);
  EXPECT_LT(in->wi.z, 0);
  EXPECT_NEAR(in->weight.x, 1 / 2.25f, 1e-6f);
  EXPECT_FLOAT_EQ(in->eta, 1.5f);

  const auto out = b->sample(in->wi, .999f, {.5f, .5f});  // back along the same path
  ASSERT_TRUE(out);
  EXPECT_NEAR((out->wi - wo).length(), 0, 1e-6f);
  EXPECT_NEAR(out->weight.x * in->weight.x, 1, 1e-6f);
  EXPECT_FLOAT_EQ(out->eta * in->eta, 1);
}

TEST(Dielectric, ReflectsTotallyBeyondTheCriticalAngle) {
  const auto b = bench(glass(1.5, 1));
  const auto s = b->sample(direction(-.5, 0), .99999f, {.5f, .5f});
  ASSERT_TRUE(s);
  EXPECT_FALSE(s->transmitted);
  EXPECT_EQ(s->weight, C3(1));
}

TEST(Dielectric, EqualIndicesPassLightUnchanged) {
  const auto b = bench(glass(1.33, 1.33));
  for (const double mu : {1., .3, 1e-4, -1e-4, -.7}) {
    const V3 wo = direction(mu, .4);
    const auto s = b->sample(wo, 0, {0, 0});
    ASSERT_TRUE(s);
    EXPECT_EQ(s->wi, -wo);
    EXPECT_EQ(s->weight, C3(1));
    EXPECT_EQ(s->eta, 1);
  }
}

TEST(Null, PassesLightUnchangedFromBothSides) {
  Scene scene;
  add(scene, NullBsdf{});
  const auto b = bench(std::move(scene));
  EXPECT_TRUE(b->bsdfs.is_null(b->bsdf));
  EXPECT_FALSE(b->bsdfs.has_smooth(b->bsdf));
  const V3 wo = direction(-.2, 1);
  EXPECT_EQ(b->sample(wo, .3f, {.1f, .2f})->wi, -wo);
}

TEST(TwoSided, ShowsItsBackMaterialFromBehindWhereOneSidedSurfacesAreBlack) {
  Scene s = diffuse({.5, .5, .5});
  add(s, DiffuseBsdf{texture(s, .25)});
  add(s, TwoSidedBsdf{{0}, {1}});
  const auto b = bench(std::move(s));
  const V3 up = direction(.5, 0), down = direction(-.5, 2);

  EXPECT_FLOAT_EQ(b->eval(up, up).f_cos.x, .5f * .5f * kInvPi);
  EXPECT_FLOAT_EQ(b->eval(down, down).f_cos.x, .25f * .5f * kInvPi);
  EXPECT_EQ(b->eval(up, down).f_cos, C3(0));
  EXPECT_LT(b->sample(down, .5f, {.3f, .4f})->wi.z, 0);
  EXPECT_EQ(b->bsdfs.eval({0}, {0, 0}, down, down).f_cos, C3(0));
  EXPECT_FALSE(b->bsdfs.sample({0}, {0, 0}, down, .5f, {.3f, .4f}));
}

TEST(Build, RefusesImpossibleMaterials) {
  const auto error = [](const Scene& s) {
    auto t = TextureTable::build(s, [](const Asset&) { return fail(Errc::not_found, "no file"); });
    const auto b = BsdfTable::build(s, *t);
    return b ? std::string() : b.error().message;
  };
  Scene s = glass(1.5, 1);
  add(s, TwoSidedBsdf{{0}, {0}});
  EXPECT_THAT(error(s),
              HasSubstr("material 1: a two-sided material cannot hold one that lets light through"));
  s.bsdfs = {TwoSidedBsdf{{0}, {0}}};
  EXPECT_THAT(error(s), HasSubstr("or itself"));
  EXPECT_THAT(error(glass(0, 1)), HasSubstr("indices of refraction 0"));
  EXPECT_THAT(error(glass(std::nan(""), 1)), HasSubstr("indices of refraction"));
  EXPECT_THAT(error(rough_metal(Microfacet::ggx, -1, .1, kGoldEta, kGoldK)),
              HasSubstr("roughness alpha = -1"));
  s.bsdfs = {DiffuseBsdf{{99}}};
  EXPECT_THAT(error(s), HasSubstr("texture 99"));
}

TEST(Build, BringsReflectancesIntoRangeAndCountsThem) {
  const auto b = bench(diffuse({.5, 2, -1}));
  EXPECT_EQ(b->bsdfs.clamped_inputs(), 1u);
  const V3 up = direction(1, 0);
  EXPECT_FLOAT_EQ(b->eval(up, up).f_cos.y, kInvPi);
  EXPECT_EQ(b->eval(up, up).f_cos.z, 0);
}

TEST(Conductor, HugeIndexReflectsEverything) {
  for (const double huge : {1e6, 1e12, 1e38, 1.7e308}) {
    for (const bool real : {true, false}) {
      const Rgb eta = real ? Rgb{huge, huge, huge} : Rgb{1, 1, 1},
                k = real ? Rgb{1, 1, 1} : Rgb{huge, huge, huge};
      const auto b = bench(rough_metal(Microfacet::ggx, 1e-4, 1e-4, eta, k));
      const auto s = b->sample(direction(.8, 1), .5f, {.2f, .7f});
      ASSERT_TRUE(s);
      // At normal incidence 1 - R is 4 / eta or 4 / k^2, at other angles at most 4 / (eta cos).
      EXPECT_NEAR(s->weight.x, 1, 8e-6) << huge;
      if (huge > 1e9) EXPECT_NEAR(s->weight.x, 1, 2e-7) << huge;
    }
  }
}

TEST(Roughness, BelowTheSpecularLimitIsAMirror) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx}) {
    const auto b = bench(rough_metal(d, 9e-4, 9e-4, kGoldEta, kGoldK));
    EXPECT_FALSE(b->bsdfs.has_smooth(b->bsdf));
    EXPECT_TRUE(b->sample(direction(.4, 1), .5f, {.2f, .7f})->delta);
  }
}

TEST(Roughness, HemisphericalReflectanceOfGgxAtRoughnessOneIsExactFromAbove) {
  // For mu = 1 and alpha = 1: D = 1 / pi, visible normals have the density cos / pi, and the masking of the
  // reflected direction is G1 = 2 z / (1 + z), with z = 2 c^2 - 1 for a normal at the cosine c. (G1 of the
  // viewer is 1, so separable and height-correlated Smith masking agree.) So E = int_{1/sqrt 2}^1 2 c G1 dc =
  // int_0^1 z / (1 + z) dz = 1 - ln 2.
  const auto b = bench(rough_metal(Microfacet::ggx, 1, 1, {0, 0, 0}, {1, 1, 1}));
  double sum = 0;
  // The midpoint rule in z has an error of n^-2 times a bounded second derivative.
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) sum += 2. * M_PI / n * b->eval({0, 0, 1}, direction((i + .5) / n, .3)).f_cos.x;
  EXPECT_NEAR(sum, 1 - std::log(2.), 1e-6);
}

TEST(Roughness, IsReciprocal) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx}) {
    const std::unique_ptr<Bench> all[] = {bench(rough_metal(d, .3, .05, kGoldEta, kGoldK)),
                                          bench(rough_metal(d, .6, .6, kGoldEta, kGoldK)),
                                          bench(rough_plastic(d, .2, 1.5, 1, true, {.2, .5, .8}))};
    for (const auto& b : all)
      for (const double mu : {.9, .4, .05})
        for (const double nu : {.95, .5, .1}) {
          const V3 a = direction(mu, .3), c = direction(nu, 2.9);
          const float ab = b->eval(a, c).f_cos.y / c.z, ba = b->eval(c, a).f_cos.y / a.z;
          // Rounding of the half vector, divided by alpha >= .05, is about 100 ulps.
          EXPECT_NEAR(ab, ba, 2e-5f * ab);
        }
  }
}

TEST(Roughness, StaysFiniteAtEveryExtreme) {
  for (const auto d : {Microfacet::beckmann, Microfacet::ggx})
    for (const double alpha : {1e-3, 1e-2, .5, 1., 10.}) {
      const std::unique_ptr<Bench> all[] = {bench(rough_metal(d, alpha, alpha, kGoldEta, kGoldK)),
                                            bench(rough_metal(d, alpha, 1e-4, kGoldEta, kGoldK)),
                                            bench(rough_plastic(d, alpha, 1.5, 1, false, {1, 1, 1}))};
      for (const auto& b : all) expect_finite(*b, {1., .5, 1e-3, 1e-7, 1e-20});
    }
}

TEST(Beckmann, InverseErrorFunctionInverts) {
  for (double x = -.9999; x < 1; x += .0137) EXPECT_NEAR(std::erf(beckmann::erf_inverse(x)), x, 1e-6);
}

TEST(RoughPlastic, EqualCoatsAreIntegratedOnce) {
  expect_equal_ones_share_tables(rough_plastic(Microfacet::ggx, .23, 1.5, 1, false, {.5, .5, .5}));
}

}  // namespace
}  // namespace ls::render::test
