// Tests the Henyey-Greenstein phase function up to extreme g, against its formula in double.
#include "worker/render/media/phase.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

const double kAnisotropies[] = {-.9999, -.9, -.5, -1e-7, 0, 1e-7, .3, .75, .99, .9999};

// The phase function in terms of x = 1 - cos of the angle to the peak, in [0, 2]; its integral is int p(x) 2
// pi dx.
double reference(double g, double x) {
  const double a = std::abs(g), s = (1 - a) * (1 - a) + 2 * a * x;
  return (1 - a) * (1 + a) / (4 * M_PI * s * std::sqrt(s));
}
V3 uniform_sphere(const V2& u) {
  const float z = 1 - 2 * u.x, r = 2 * safe_sqrt(u.x * (1 - u.x)), a = kTwoPi * u.y;
  return {r * std::cos(a), r * std::sin(a), z};
}
float g_of(double g) { return static_cast<float>(g); }

TEST(HenyeyGreenstein, MatchesItsFormulaForAllAnglesFromThePeak) {
  const V3 w = normalize(V3(.3f, -.5f, .8f));
  const Frame frame(w);
  for (const double g : kAnisotropies) {
    for (const double angle : {1e-3, .1, 1., 2., 3.1}) {
      const auto sine = static_cast<float>(std::sin(angle)), cosine = static_cast<float>(std::cos(angle));
      const float sign = g >= 0 ? 1.f : -1.f;
      const V3 w1 = frame.to_world({sine, 0, sign * cosine});
      const double got = HenyeyGreenstein{g_of(g)}.value(w, w1);
      // x is |w - w1|^2 / 2 of unit vectors with errors of 1e-7. So its relative error is 2e-7 / sin(angle /
      // 2), which is at most 4e-4 (at the angle 1e-3) where the value depends on x. The power 3/2 at most
      // doubles it.
      const double tolerance = 8e-7 / std::sin(angle / 2) + 2e-6;
      const double exact = reference(double{g_of(g)}, 2 * std::pow(std::sin(angle / 2), 2));
      EXPECT_NEAR(got / exact, 1, tolerance) << "g " << g << " angle " << angle;
    }
  }
}

TEST(HenyeyGreenstein, ForwardPeakIsExact) {
  const V3 w(0, 0, 1);
  // 4 pi p(0) = (1 + g) / (1 - g)^2, with g rounded to float32.
  const double g = g_of(.9999);
  EXPECT_NEAR(4 * M_PI * HenyeyGreenstein{g_of(.9999)}.value(w, w) / ((1 + g) / ((1 - g) * (1 - g))), 1,
              1e-6);
}

TEST(HenyeyGreenstein, DensityOfASampleIsItsValue) {
  RandomStream r(1);
  for (const double g : kAnisotropies) {
    const HenyeyGreenstein hg{g_of(g)};
    for (int i = 0; i < 1000; ++i) {
      const V3 w = uniform_sphere({r.uniform(), r.uniform()});
      const float u = r.uniform(), v = r.uniform();
      const PhaseSample s = hg.sample(w, {u, v});
      ASSERT_NEAR(dot(s.w, s.w), 1, 1e-6);
      // value() uses the direction rounded to 1e-7. At |g| = .9999 this is a share of 1e-7 / 1e-4 of the
      // peak's width, times the peak's slope of 3.
      const double width = std::max(1 - std::abs(g), 1e-4);
      ASSERT_NEAR(hg.value(w, s.w) / s.pdf, 1, 2e-6 / width + 1e-5) << "g " << g;
    }
  }
}

// With the largest float32 number below 1 as g, the phase function is narrow but finite, also for random
// numbers at the ends of their range.
TEST(HenyeyGreenstein, IsFiniteUpToTheLastFloatBelowOne) {
  for (const float sign : {1.f, -1.f}) {
    const HenyeyGreenstein hg{sign * (1 - 0x1p-24f)};
    for (const float u : {0.f, 0x1p-24f, .5f, 1 - 0x1p-24f}) {
      const V3 w = normalize(V3(.3f, -.5f, .8f));
      const PhaseSample s = hg.sample(w, {u, .3f});
      EXPECT_TRUE(is_finite(s.w)) << u;
      EXPECT_NEAR(dot(s.w, s.w), 1, 1e-6) << u;
      EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf > 0) << u;
      EXPECT_TRUE(std::isfinite(hg.value(w, s.w))) << u;
    }
  }
}

TEST(HenyeyGreenstein, IsNormalisedAndItsMeanCosineIsG) {
  for (const double g : kAnisotropies) {
    double mass = 0, cosine = 0;
    constexpr int kSteps = 200000;
    const HenyeyGreenstein hg{g_of(g)};
    const V3 w(0, 0, 1);
    double last = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double a = std::abs(double{g_of(g)});
      // Both integrals are over x = 1 - cos of the angle to the peak. A geometric grid in (1 - a)^2 + x
      // resolves the peak.
      const double lo = (1 - a) * (1 - a), x1 = lo * std::pow((lo + 2) / lo, (i + 1.) / kSteps) - lo,
                   x = (last + x1) / 2;
      const double sine = std::sqrt(x * (2 - x)), c = g >= 0 ? 1 - x : x - 1;
      const double p = hg.value(w, {static_cast<float>(sine), 0, static_cast<float>(c)});
      mass += 2 * M_PI * p * (x1 - last);
      cosine += 2 * M_PI * p * c * (x1 - last);
      last = x1;
    }
    // The midpoint rule has relative steps of 1e-4, and float32 directions have relative errors of 1e-7 / (1
    // - g), which average out.
    EXPECT_NEAR(mass, 1, 1e-3) << "g " << g;
    EXPECT_NEAR(cosine, g, 1e-3) << "g " << g;
  }
}

}  // namespace
}  // namespace ls::render
