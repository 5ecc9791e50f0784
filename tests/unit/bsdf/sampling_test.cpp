// Samples follow their density, weights match values, and no surface reflects more energy than it receives.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/fresnel.h"

namespace ls::render::test {
namespace {

constexpr int kMaterials = 53;
const double kViewCosines[] = {.98, .5, .1};
const double kViewCosinesFromBehind[] = {-.95, -.6, -.2};

struct Named {
  std::string name;
  std::unique_ptr<Bench> bench;
  bool both_sides = false;
};
void add_more(std::vector<Named>& all) {
  const auto one_sided = [&](std::string name, Scene s) {
    all.push_back({std::move(name), bench(std::move(s))});
  };
  const auto wide = [&](std::string name, Scene s) {
    all.push_back({std::move(name), bench(std::move(s)), true});
  };
  one_sided("gold that scatters often",
            with_compensation(rough_metal(Microfacet::ggx, .6, .6, kGoldEta, kGoldK)));
  one_sided("plastic that scatters often",
            with_compensation(rough_plastic(Microfacet::beckmann, .4, 1.5, 1, true, {.5, .4, .3})));
  wide("glass that scatters often", with_compensation(rough_glass(Microfacet::ggx, .5, .5, 1.5, 1)));
  wide("thin glass and rough gold",
       blend(thin_glass(1.5), rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .6));
  // As Nori's rough plastic is read: a base, and a coat with the share that the base leaves
  // (nori_microfacet_test.cpp).
  one_sided("diffuse and metal",
            blend(diffuse({.2, .6, .4}),
                  rough_metal(Microfacet::beckmann, .3, .3, {1.5, 1.5, 1.5}, {0, 0, 0}), .4));
  one_sided("rough gold under a smooth coat", coated(0, .3, .3, kGoldEta, kGoldK));
  one_sided("smooth gold under a rough coat", coated(.3, 0, 0, kGoldEta, kGoldK));
  one_sided("brushed metal under a rough coat", coated(.2, .4, .1, {0, 0, 0}, {1, 1, 1}, 1.9, {.9, .8, .7}));
  wide("leaf", leaf({.2, .5, .1}, {.3, .4, .9}));
  wide("leaf that only transmits", leaf({0, 0, 0}, {.5, .5, .5}));
  for (const auto& [d, name] :
       {std::pair{Microfacet::beckmann, "beckmann"}, std::pair{Microfacet::ggx, "ggx"}}) {
    for (const double a : {.1, .5})
      wide(fmt::format("rough sheet {} {}", name, a), rough_sheet(d, a, a, 1.5, {.9, .8, .7}, {.5, .6, .7}));
  }
  wide("rough sheet .4 x .1", rough_sheet(Microfacet::ggx, .4, .1, 1.33));
  wide("rough sheet that scatters often", with_compensation(rough_sheet(Microfacet::ggx, .6, .6, 1.5)));
  wide("glass under a normal map",
       turned(rough_glass(Microfacet::beckmann, .3, .3, 1.5, 1), direction(.95, 1)));
}
std::vector<Named> smooth_materials() {
  std::vector<Named> all;
  all.push_back({"diffuse", bench(diffuse({.2, .5, .9}))});
  for (const auto& [d, name] :
       {std::pair{Microfacet::beckmann, "beckmann"}, std::pair{Microfacet::ggx, "ggx"}}) {
    for (const double a : {.05, .3, 1.})
      all.push_back({fmt::format("metal {} {}", name, a), bench(rough_metal(d, a, a, kGoldEta, kGoldK))});
    all.push_back({fmt::format("metal {} .3 x .05", name), bench(rough_metal(d, .3, .05, kGoldEta, kGoldK))});
    for (const double a : {.06, .2, .7})
      all.push_back(
          {fmt::format("plastic {} {}", name, a), bench(rough_plastic(d, a, 1.5, 1, false, {.5, .4, .3}))});
  }
  all.push_back({"smooth plastic", bench(plastic(1.5, 1, true, {.5, .4, .3}))});
  all.push_back({"masked gold", bench(masked(rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .3))});
  const auto wide = [&](std::string name, Scene s) {
    all.push_back({std::move(name), bench(std::move(s)), true});
  };
  wide("smooth plastic on both sides", two_sided(plastic(1.9, 1, false, {.1, .9, .3}, {.5, .5, .5})));
  for (const auto& [d, name] :
       {std::pair{Microfacet::beckmann, "beckmann"}, std::pair{Microfacet::ggx, "ggx"}}) {
    for (const double a : {.1, .4, 1.})
      wide(fmt::format("glass {} {}", name, a), rough_glass(d, a, a, 1.5, 1, {.9, .8, .7}, {.5, .6, .7}));
    wide(fmt::format("glass {} .4 x .1", name), rough_glass(d, .4, .1, 1.33, 1));
  }
  wide("gold under a normal map",
       two_sided(turned(rough_metal(Microfacet::beckmann, .4, .2, kGoldEta, kGoldK), direction(.9, 2))));
  wide("gold and glass", blend(rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK),
                               rough_glass(Microfacet::beckmann, .3, .3, 1.5, 1), .6));
  wide("masked gold and glass", blend(masked(rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .3),
                                      rough_glass(Microfacet::beckmann, .3, .3, 1.5, 1), .4));
  all.push_back({"principled", bench(principled({}))});
  all.push_back({"principled metal", bench(principled(metal_values()))});
  all.push_back({"principled cloth", bench(principled(cloth_values()))});
  wide("gold under a flipping normal map",
       two_sided(mapped(rough_metal(Microfacet::beckmann, .4, .2, kGoldEta, kGoldK), {.9, .4, .6}, false)));
  all.push_back({"gold under a bump map",
                 bench(two_sided(bumped(rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK), .7, false)),
                       oracle_heights()),
                 true});
  wide("principled glass", principled(glass_values()));
  wide("principled with everything", principled(all_values()));
  add_more(all);
  return all;
}

// The grid over the sphere has points .005 rad apart in theta and .003 rad in phi. The narrowest lobe (alpha
// .05, seen at the cosine .1) is 2 alpha = .1 wide in theta and 2 alpha cos = .01 in phi.
constexpr int kThetaCells = 32, kPhiCells = 32, kSubTheta = 20, kSubPhi = 64, kSamples = 100000;
constexpr int kCells = kThetaCells * kPhiCells;

// Returns the expected counts of the cells; the last entry is for samples without direction or of a delta
// lobe. From one phi to the next the points move in theta by the golden ratio of a step: the density of
// refraction by GGX facets ends abruptly at one theta, which a plain grid would hit or miss as a whole.
std::vector<double> expected_cells(const Bench& b, const V3& wo) {
  std::vector<double> p(kCells + 1, 0);
  const double dt = M_PI / (kThetaCells * kSubTheta), df = 2 * M_PI / (kPhiCells * kSubPhi);
  double total = 0;
  for (int i = 0; i < kThetaCells * kSubTheta; ++i) {
    for (int j = 0; j < kPhiCells * kSubPhi; ++j) {
      const double golden = .6180339887498949 * (j + .5), theta = (i + golden - std::floor(golden)) * dt;
      const double mass =
          b.eval(wo, direction(std::cos(theta), (j + .5) * df)).pdf * std::sin(theta) * dt * df;
      p[static_cast<std::size_t>(i / kSubTheta * kPhiCells + j / kSubPhi)] += mass;
      total += mass;
    }
  }
  EXPECT_LE(total, 1 + 1e-3);
  p[kCells] = std::max(0., 1 - total);
  for (double& x : p) x *= kSamples;
  return p;
}

std::vector<double> observed_cells(const Bench& b, const V3& wo, unsigned seed) {
  std::mt19937 rng(seed);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  std::vector<double> n(kCells + 1, 0);
  for (int k = 0; k < kSamples; ++k) {
    const float lobe = uniform(), x = uniform(), y = uniform();
    const auto s = b.sample(wo, lobe, {x, y});
    if (!s || s->delta) {
      ++n[kCells];
      continue;
    }
    const int i = std::min(static_cast<int>(std::acos(std::clamp(s->wi.z, -1.f, 1.f)) / M_PI * kThetaCells),
                           kThetaCells - 1);
    double phi = std::atan2(s->wi.y, s->wi.x);
    if (phi < 0) phi += 2 * M_PI;
    ++n[static_cast<std::size_t>(i * kPhiCells +
                                 std::min(static_cast<int>(phi / (2 * M_PI) * kPhiCells), kPhiCells - 1))];
  }
  return n;
}

TEST(Sampling, FollowsItsDensity) {
  ls::test::ChiSquareTally tally("bsdf/sampling");
  auto all = smooth_materials();
  ASSERT_EQ(all.size(), std::size_t{kMaterials});
  unsigned seed = 1;
  for (const Named& m : all) {
    std::vector<double> views(std::begin(kViewCosines), std::end(kViewCosines));
    if (m.both_sides)
      views.insert(views.end(), std::begin(kViewCosinesFromBehind), std::end(kViewCosinesFromBehind));
    for (const double mu : views) {
      const V3 wo = direction(mu, .7);
      tally.expect(fmt::format("{} at mu {}", m.name, mu), expected_cells(*m.bench, wo),
                   observed_cells(*m.bench, wo, ++seed));
    }
  }
  tally.close();
}

// Tests single lobes, because a mixture of lobes is not one map of the unit square.
TEST(Sampling, SamplingJacobianIsOneOverTheDensity) {
  const auto lobe = [](const Bench& b, const V3& wo, float u_lobe, const auto& chance) {
    return [&b, wo, u_lobe, chance](const V2& u) -> std::optional<ls::test::Mapped> {
      const auto s = b.sample(wo, u_lobe, u);
      if (!s || s->delta) return std::nullopt;
      return ls::test::Mapped{V3d(s->wi), double{s->pdf} / chance(s->wi)};
    };
  };
  const auto always = [](const V3&) { return 1.; };
  for (const double mu : {.98, .5, .1}) {
    const V3 wo = direction(mu, .7);
    const auto paper = bench(diffuse({.5, .5, .5}));
    ls::test::expect_jacobian(fmt::format("diffuse at {}", mu), lobe(*paper, wo, .5f, always));
    const auto green = bench(leaf({.25, .25, .25}, {.75, .75, .75}));
    for (const bool out : {true, false}) {
      const V3 o(wo.x, wo.y, out ? wo.z : -wo.z);
      const auto chance = [=](const V3& wi) { return wi.z * o.z > 0 ? .25 : .75; };
      ls::test::expect_jacobian(fmt::format("reflected by a leaf at {}", o.z), lobe(*green, o, 0, chance));
      ls::test::expect_jacobian(fmt::format("transmitted by a leaf at {}", o.z),
                                lobe(*green, o, 1 - 0x1p-24f, chance));
    }
    for (const auto& [d, name] :
         {std::pair{Microfacet::beckmann, "beckmann"}, std::pair{Microfacet::ggx, "ggx"}}) {
      for (const double a : {.1, .3, 1.}) {
        const auto metal = bench(rough_metal(d, a, a, kGoldEta, kGoldK));
        ls::test::expect_jacobian(fmt::format("metal {} {} at {}", name, a, mu),
                                  lobe(*metal, wo, .5f, always));
      }
      // For glass, tests the reflected and the refracted lobe; the probability of each is given by the
      // Fresnel reflectance at the half vector.
      const auto window = bench(rough_glass(d, .3, .3, 1.5, 1));
      for (const bool out : {true, false}) {
        const double eta = out ? 1.5 : 1 / 1.5;
        const V3 o(wo.x, wo.y, out ? wo.z : -wo.z);
        const auto fresnel = [=](const V3& wi) {
          const bool reflected = wi.z * o.z > 0;
          V3 h = normalize(o + wi * (reflected ? 1.f : static_cast<float>(eta)));
          const double R = fresnel_dielectric(std::abs(dot(o, h)), eta).reflectance;
          return reflected ? R : 1 - R;
        };
        ls::test::expect_jacobian(fmt::format("reflected by glass {} at {}", name, o.z),
                                  lobe(*window, o, 0, fresnel));
        // From inside, most facets totally reflect grazing light.
        if (out)
          ls::test::expect_jacobian(fmt::format("refracted by glass {} at {}", name, o.z),
                                    lobe(*window, o, 1 - 0x1p-24f, fresnel));
      }
      const auto pane = bench(rough_sheet(d, .3, .3, 1.5));
      for (const bool out : {true, false}) {
        const V3 o(wo.x, wo.y, out ? wo.z : -wo.z);
        const auto both_sides = [=](const V3& wi) {
          const bool reflected = wi.z * o.z > 0;
          const V3 h = normalize(o + V3(wi.x, wi.y, reflected ? wi.z : -wi.z));
          const double r = fresnel_dielectric(std::abs(dot(o, h)), 1.5).reflectance, R = 2 * r / (1 + r);
          return reflected ? R : 1 - R;
        };
        ls::test::expect_jacobian(fmt::format("reflected by a rough sheet {} at {}", name, o.z),
                                  lobe(*pane, o, 0, both_sides));
        ls::test::expect_jacobian(fmt::format("transmitted by a rough sheet {} at {}", name, o.z),
                                  lobe(*pane, o, 1 - 0x1p-24f, both_sides));
      }
    }
  }
}

TEST(Sampling, WeightTimesDensityIsTheValue) {
  std::mt19937 rng(5);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (const Named& m : smooth_materials())
    for (const double mu : {.999, .6, .2, .01, -.05, -.5, -.9}) {
      const V3 wo = direction(mu, 2);
      for (int k = 0; k < 500; ++k) {
        const float lobe = uniform(), x = uniform(), y = uniform();
        const auto s = m.bench->sample(wo, lobe, {x, y});
        if (!s || s->delta) continue;
        EXPECT_EQ(s->transmitted, s->wi.z * wo.z < 0) << m.name;
        const BsdfEval e = m.bench->eval(wo, s->wi);
        // eval() computes the half vector from wi with an error of 1e-7. Divided by alpha >= .05, and times
        // the slopes of the lobe's tail (up to 5 alpha), this is a relative error of about 1e-4. Samples
        // farther out in the tail are rare, but have larger errors.
        EXPECT_NEAR(e.pdf, s->pdf, 1e-3f * s->pdf) << m.name;
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(s->weight[c] * s->pdf, e.f_cos[c], 1e-3f * e.f_cos[c] + 1e-20f) << m.name;
      }
    }
}

}  // namespace
}  // namespace ls::render::test
