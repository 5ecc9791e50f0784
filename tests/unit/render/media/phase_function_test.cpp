// Tests the phase functions other than Henyey-Greenstein's: their integrals, mean cosines and closed forms,
// and extreme parameters.
#include "worker/render/media/phase_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/phase_kinds.h"
#include "worker/render/math/random.h"
#include "worker/render/media/grid.h"
#include "worker/render/media/phase.h"

namespace ls::render {
namespace {

using test::integral;

PhaseFunctions only(PhaseFunctions::Kind kind) {
  PhaseFunctions all;
  all.add(std::move(kind));
  return all;
}
template <class Lobe>
double mean_cosine(const Lobe& lobe) {
  return integral([&](const ScatteringAngle& a) { return lobe.density(a) * a.cosine(); });
}

TEST(PhaseFunctions, IntegrateToOneInEveryColour) {
  for (const test::NamedPhase& kind : test::phase_kinds()) {
    for (int c = 0; c < 3; ++c) {
      const double mass = integral([&](const ScatteringAngle& a) { return kind.value(a)[c]; });
      EXPECT_NEAR(mass, 1, test::kIntegralError) << kind.name << " colour " << c;
    }
    const double mass = integral([&](const ScatteringAngle& a) { return kind.pdf(a); });
    EXPECT_NEAR(mass, 1, test::kIntegralError) << kind.name;
  }
}

TEST(PhaseFunctions, HaveTheirMeanCosines) {
  EXPECT_NEAR(mean_cosine(RayleighLobe{}), 0, test::kIntegralError);
  // <cos> and <cos^3> of Henyey-Greenstein are g and (3 g + 2 g^3) / 5
  for (const double g : {-.9999, -.5, 0., .04, .06, .7, .9999})
    for (const double alpha : {0., 1e-9, 1., 40., 1000.})
      EXPECT_NEAR(mean_cosine(DraineLobe{g, alpha}),
                  (g + alpha * (3 * g + 2 * g * g * g) / 5) / (1 + alpha * (1 + 2 * g * g) / 3),
                  test::kIntegralError)
          << g << " " << alpha;
  // Figures of an independent integration of the paper's formulas, to three digits
  for (const auto& [diameter, g] : {std::pair(5., .843), {10., .864}, {20., .879}, {50., .891}})
    EXPECT_NEAR(mean_cosine(DropletLobe::of_diameter(diameter)), g, 6e-4) << diameter;
  for (const test::NamedPhase& kind : test::phase_kinds()) {
    const double exact = integral([&](const ScatteringAngle& a) { return kind.pdf(a) * a.cosine(); });
    EXPECT_NEAR(kind.all.mean_cosine(kind.which), exact, 1e-3) << kind.name;
  }
}

TEST(PhaseFunctions, AgreeWhereOneIsASpecialCaseOfAnother) {
  for (const double x : {0., 1e-9, .01, .5, 1., 1.7, 2.}) {
    const ScatteringAngle a{x, 2 - x};
    EXPECT_NEAR(DraineLobe({0, 1}).density(a) / RayleighLobe{}.density(a), 1, 1e-14);
    for (const double g : {-.99, -.2, 0., .6, .9999}) {
      const double hg = HenyeyGreensteinLobe{g}.density(a);
      EXPECT_NEAR(DraineLobe({g, 0}).density(a) / hg, 1, 1e-14) << g;
      EXPECT_NEAR(DraineLobe({g, 1e-12}).density(a) / hg, 1, 1e-11) << g;
    }
  }
}

// The published form divides by powers of 1 - delta and by the sine; at these angles it has 9 digits.
TEST(FournierForand, MatchesThePublishedForm) {
  for (const double backscatter : {.001, .018, .1, .4})
    for (const double n : {1.05, 1.1, 1.33, 1.7}) {
      const FournierForandLobe lobe(backscatter, n);
      const double k = 4 / (3 * (n - 1) * (n - 1)),
                   nu = -std::log(1 + 2 * backscatter * (k / 2 - 1)) / std::log(k / 2), b = std::pow(k, nu);
      for (const double degrees : {.1, 1., 10., 45., 90., 135., 170.}) {
        const double angle = degrees * kPiD / 180, s2 = sqr(std::sin(angle / 2)), d = k * s2,
                     dn = std::pow(d, nu), c = std::cos(angle);
        const double published =
            (nu * (1 - d) - (1 - dn) + (d * (1 - dn) - nu * (1 - d)) / s2) / (4 * kPiD * sqr(1 - d) * dn) +
            (1 - b) / (16 * kPiD * (k - 1) * b) * (3 * c * c - 1);
        EXPECT_NEAR(lobe.density({2 * s2, 2 - 2 * s2}) / published, 1, 1e-8 + 1e-15 / sqr(1 - d))
            << backscatter << " " << n << " " << degrees;
      }
    }
}

TEST(FournierForand, ScattersItsShareBackwards) {
  for (const double backscatter : {1e-5, .018, .1, .5})
    // With 1.8165, delta is 1 at 90 degrees, and near it with 1.8164
    for (const double n : {1.0001, 1.1, 1.33, 1.8164, 1 + std::sqrt(2. / 3), 1 + std::sqrt(1. / 3), 5.}) {
      const FournierForandLobe lobe(backscatter, n);
      const double back = integral([&](const ScatteringAngle& a) { return a.x > 1 ? lobe.density(a) : 0; });
      EXPECT_NEAR(back, backscatter, test::kIntegralError) << backscatter << " " << n;
    }
}

TEST(FournierForand, IsFiniteStraightOn) {
  for (const double backscatter : {1e-5, .1, .5})
    for (const double n : {1.0001, 1.33, 5.}) {
      const double peak = FournierForandLobe(backscatter, n).density({0, 2});
      EXPECT_TRUE(peak > 0 && peak < 2 / FournierForandLobe::kLeast) << peak;
    }
}

// The share of light below the angle of a sample is the random number: an exact inversion.
TEST(PhaseFunctions, InvertTheirDistributions) {
  const auto expect = [](const std::string& name, const auto& lobe) {
    const bool backwards =
        lobe.sample(.25).x > lobe.sample(.75).x;  // g > 0: random numbers begin at the back
    for (const double u : {1e-6, .01, .3, .5, .8, .99, 1 - 1e-6}) {
      const ScatteringAngle s = lobe.sample(u);
      const double below = test::integral_below(s, [&](const ScatteringAngle& a) { return lobe.density(a); });
      EXPECT_NEAR(backwards ? 1 - below : below, u, 2 * test::kIntegralError) << name << " " << u;
    }
  };
  expect("rayleigh", RayleighLobe{});
  for (const double g : {-.9, 0., 1e-7, .049, .051, .7, .999})
    for (const double alpha : {0., 1e-9, 1., 40., 1000.}) expect("draine", DraineLobe{g, alpha});
  for (const double b : {.001, .018, .1, .5})
    for (const double n : {1.02, 1.33, 2.}) expect("fournier_forand", FournierForandLobe(b, n));
}

TEST(PhaseFunctions, AreTheSameForwardsAndBackwardsInTime) {
  RandomStream r(3);
  const auto direction = [&] {
    const float z = 1 - 2 * r.uniform(), angle = kTwoPi * r.uniform(), s = safe_sqrt(1 - z * z);
    return normalize(V3(s * std::cos(angle), s * std::sin(angle), z));
  };
  for (const test::NamedPhase& kind : test::phase_kinds())
    for (int i = 0; i < 100; ++i) {
      const V3 w = direction(), w1 = direction();
      const auto there = kind.all.value(kind.which, V3(0), w, w1),
                 back = kind.all.value(kind.which, V3(0), w1, w),
                 turned = kind.all.value(kind.which, V3(0), -w1, -w);
      ASSERT_EQ(there.value, back.value) << kind.name;
      ASSERT_EQ(there.value, turned.value) << kind.name;
      ASSERT_EQ(there.pdf, back.pdf) << kind.name;
    }
}

// The density of a sample is that of its direction, and weights are bounded: no colour weighs more than 3.
TEST(PhaseFunctions, SampleDirectionsWithTheirDensity) {
  RandomStream r(5);
  const V3 w = normalize(V3(.3f, -.5f, .8f));
  for (const test::NamedPhase& kind : test::phase_kinds())
    for (int i = 0; i < 1000; ++i) {
      const float u = r.uniform(), v = r.uniform();
      const auto s = kind.all.sample(kind.which, V3(0), w, {u, v});
      ASSERT_NEAR(dot(s.w, s.w), 1, 1e-6);
      ASSERT_GT(s.of.pdf, 0) << kind.name;
      ASSERT_LE(max_component(s.of.value), 3.0001f * s.of.pdf) << kind.name;
      // value() has the direction rounded to 1e-7, which changes x by up to 2e-7 sqrt(x)
      const ScatteringAngle a = ScatteringAngle::between(w, s.w);
      const double x = std::min(a.x, a.y), change = 1e-6 / std::sqrt(x + 1e-14);
      if (change > .01) continue;
      ASSERT_NEAR(kind.all.value(kind.which, V3(0), w, s.w).pdf / s.of.pdf, 1, 1e-5 + kind.steepness * change)
          << kind.name << " x " << x;
    }
}

TEST(PhaseFunctions, AreFiniteAtTheEndsOfAllRandomNumbersAndParameters) {
  std::vector<PhaseFunctions::Kind> extremes;
  for (const double g : {-.99999, 0., .99999, 1 - 0x1p-24})
    for (const double alpha : {0., 1e-300, 1000.}) extremes.push_back(DraineLobe{g, alpha});
  for (const double d : {1e-3, .1, .1001, 1.4999, 1.5, 4.9999, 5., 50.})
    extremes.push_back(DropletLobe::of_diameter(d));
  for (const double b : {1e-5, .5})
    for (const double n : {1.0001, 5.}) extremes.push_back(FournierForandLobe(b, n));
  const std::vector<double> all_back[] = {{1, 0}}, spike[] = {{0, 0, 1e-300, 0, 0}}, cliff[] = {{0, 1e30}};
  extremes.push_back(TabulatedLobe(std::vector<double>{-1, 1}, all_back));
  extremes.push_back(TabulatedLobe(std::vector<double>{-1, -.5, 0, 1e-12, 1}, spike));
  extremes.push_back(TabulatedLobe(std::vector<double>{-1, 1}, cliff));
  for (std::size_t k = 0; k < extremes.size(); ++k) {
    const PhaseFunctions all = only(extremes[k]);
    for (const V3& w : {V3(0, 0, -1), normalize(V3(.3f, -.5f, .8f))}) {
      for (const float u : {0.f, 0x1p-24f, .5f, 1 - 0x1p-24f}) {
        const auto s = all.sample(0, V3(0), w, {u, .3f});
        EXPECT_TRUE(is_finite(s.w)) << k << " " << u;
        EXPECT_NEAR(dot(s.w, s.w), 1, 1e-6) << k << " " << u;
        EXPECT_TRUE(std::isfinite(s.of.pdf) && is_finite(s.of.value)) << k << " " << u;
      }
      for (const V3& w1 : {w, -w, Frame(w).s}) {
        const auto v = all.value(0, V3(0), w, w1);
        EXPECT_TRUE(std::isfinite(v.pdf) && v.pdf >= 0 && is_finite(v.value)) << k;
      }
    }
  }
}

TEST(TabulatedPhase, IsLinearInTheCosineAndNeverSampledWhereItIsZero) {
  const std::vector<double> values[] = {{2, 0, 0, 0, 1, 3, 0}};
  const TabulatedLobe lobe(std::vector<double>{-1, -.9, -.5, 0, .2, .6, 1}, values);
  const auto at = [&](double c) { return lobe.density({1 - c, 1 + c}); };
  EXPECT_NEAR(at(-.95) / at(-1), .5, 1e-12);
  EXPECT_NEAR(at(.4) / at(-1), 1, 1e-12);
  EXPECT_EQ(at(-.7), 0);
  EXPECT_EQ(at(-.2), 0);
  EXPECT_EQ(at(1), 0);
  for (int i = 0; i < 10000; ++i) {
    const double c = lobe.sample((i + .5) / 10000).cosine();
    EXPECT_FALSE(c > -.9 && c < 0) << c;
  }
}

// A peak 1e6 times as high as the rest, over a million angles
TEST(TabulatedPhase, HasTheSameShapeAtAnyScale) {
  const std::vector<double> cosines{-1, .2, 1}, values{1, 4, 2};
  const TabulatedLobe plain(cosines, std::vector<std::vector<double>>{values});
  for (const double scale : {5e-324, 1e-300, 1e29}) {
    std::vector<double> scaled = values;
    for (double& v : scaled) v *= scale;
    const TabulatedLobe lobe(cosines, std::vector<std::vector<double>>{scaled});
    for (const double x : {0., .7, 2.})
      EXPECT_DOUBLE_EQ(lobe.density({x, 2 - x}), plain.density({x, 2 - x})) << scale;
  }
}

TEST(TabulatedPhase, KeepsANarrowPeakAmongAMillionAngles) {
  constexpr std::size_t kAngles = 1'000'000;
  std::vector<double> cosines(kAngles), values(kAngles, 1);
  for (std::size_t i = 0; i < kAngles; ++i) cosines[i] = -1 + 2 * static_cast<double>(i) / (kAngles - 1);
  values.back() = 1e6;
  const std::vector<double> lists[] = {values};
  const TabulatedLobe lobe(cosines, lists);
  // The last cell has the mass h (1 + 1e6) / 2, all others together 2 - h, with h = 2 / (kAngles - 1)
  const double h = 2. / (kAngles - 1), peak = h * 500'000.5 / (2 - h + h * 500'000.5);
  EXPECT_NEAR(lobe.density({0, 2}) * 2 * kPiD * h / 2 / peak, 1, 2e-6);
  EXPECT_LT(lobe.sample(peak * .999).x, h);
  EXPECT_GT(lobe.sample(peak * 1.001).x, h);
}

TEST(BlendedPhase, FollowsItsGrid) {
  // Weights 0 to 1 along x, at the nodes 0 to 10
  std::vector<float> weights;
  for (int i = 0; i <= 10; ++i) weights.push_back(static_cast<float>(i) / 10);
  const Grid grid({11, 1, 1}, weights, Affine{}, V3d(0), V3d(10, 0, 0), 1);
  PhaseFunctions all;
  all.add(BlendedLobes{.grid = &grid, .first = 1, .second = 2});
  all.add(RayleighLobe{});
  all.add(HenyeyGreensteinLobe{.5});
  const V3 w(0, 0, 1), w1 = normalize(V3(1, 0, 2));
  const float first = all.value(1, V3(0), w, w1).pdf, second = all.value(2, V3(0), w, w1).pdf;
  for (const float x : {-3.f, 0.f, 2.5f, 10.f, 99.f}) {
    const float share = std::clamp(x / 10, 0.f, 1.f);
    EXPECT_NEAR(all.value(0, V3(x, 0, 0), w, w1).pdf, (1 - share) * first + share * second, 1e-6f) << x;
    const auto s = all.sample(0, V3(x, 0, 0), w, {.3f, .6f});
    EXPECT_NEAR(all.value(0, V3(x, 0, 0), w, s.w).pdf / s.of.pdf, 1, 1e-5f) << x;
  }
}

}  // namespace
}  // namespace ls::render
