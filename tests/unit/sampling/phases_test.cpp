// Phase functions: samples by chi-square, the map by its Jacobian.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/support/phase_kinds.h"
#include "worker/render/math/random.h"
#include "worker/render/media/phase.h"

namespace ls::render {
namespace {

const float kAnisotropies[] = {-.9999f, -.9f, -.5f, -1e-7f, 0, 1e-7f, .3f, .75f, .99f, .9999f};
const V3 kWays[] = {normalize(V3(.3f, -.5f, .8f)), V3(0, 0, -1)};

// Probability that 1 - cos of the angle to the peak is below x.
double distribution(double g, double x) {
  const double a = std::abs(g);
  if (a < 1e-6) return x / 2;  // to first order in a, 1e-6 here
  const double root = std::sqrt((1 - a) * (1 - a) + 2 * a * x);
  return (1 - a) * (1 + a) / (2 * a) * (1 / (1 - a) - 1 / root);
}

// In cells of equal probability, by the closed form of the polar angle's distribution and by azimuth.
TEST(Phases, SamplesFollowTheirDensity) {
  test::ChiSquareTally tally("sampling/phases");
  constexpr int kRows = 16, kColumns = 12, kSamples = 100000;
  for (const V3& w : kWays)
    for (const float g : kAnisotropies) {
      const V3d peak = V3d(w) * (g >= 0 ? 1. : -1.);
      const Frame frame(w);
      std::vector<double> expected(kRows * kColumns, double{kSamples} / (kRows * kColumns)),
          got(expected.size(), 0);
      RandomStream r(7);
      for (int i = 0; i < kSamples; ++i) {
        const float u = r.uniform(), v = r.uniform();
        const V3 s = HenyeyGreenstein{g}.sample(w, {u, v}).w;
        const V3d chord = V3d(s) - peak;
        const int row =
            std::min(kRows - 1, static_cast<int>(distribution(double{g}, .5 * chord.dot(chord)) * kRows));
        const double turn = std::atan2(chord.dot(V3d(frame.t)), chord.dot(V3d(frame.s))) / (2 * M_PI);
        const int column = std::min(kColumns - 1, static_cast<int>((turn < 0 ? turn + 1 : turn) * kColumns));
        ++got[static_cast<std::size_t>(row * kColumns + column)];
      }
      tally.expect(fmt::format("g {} about ({}, {}, {})", g, w.x, w.y, w.z), expected, got);
    }
  tally.close();
}

// The other phase functions (phase_function.h): cells of about equal probability by the angle, whose shares
// are integrals of the density, and by azimuth.
TEST(Phases, OtherKindsFollowTheirDensity) {
  test::ChiSquareTally tally("sampling/other_phases");
  constexpr int kRows = 16, kColumns = 12, kSamples = 100000;
  for (const test::NamedPhase& kind : test::phase_kinds()) {
    const auto density = [&](const ScatteringAngle& a) { return kind.pdf(a); };
    // The ends of the rows are quantiles of samples; which ones does not matter to the test
    RandomStream r(11);
    std::vector<ScatteringAngle> drawn;
    for (int i = 0; i < 4096; ++i) {
      const float u = r.uniform(), v = r.uniform();
      drawn.push_back(
          ScatteringAngle::between(V3(0, 0, 1), kind.all.sample(kind.which, V3(0), V3(0, 0, 1), {u, v}).w));
    }
    const auto before = [](const ScatteringAngle& a, const ScatteringAngle& b) {
      return a.x < a.y || b.x < b.y ? a.x < b.x : a.y > b.y;
    };
    std::ranges::sort(drawn, before);
    std::vector<ScatteringAngle> ends;
    for (std::size_t i = 1; i < kRows; ++i) ends.push_back(drawn[i * drawn.size() / kRows]);
    std::vector<double> expected;
    double last = 0;
    for (std::size_t i = 0; i < kRows; ++i) {
      const double below = i + 1 < kRows ? test::integral_below(ends[i], density) : 1;
      expected.insert(expected.end(), kColumns, (below - last) * kSamples / kColumns);
      last = below;
    }
    for (const V3& w : kWays) {
      const Frame frame(w);
      std::vector<double> got(expected.size(), 0);
      for (int i = 0; i < kSamples; ++i) {
        const float u = r.uniform(), v = r.uniform();
        const V3 s = kind.all.sample(kind.which, V3(0), w, {u, v}).w;
        const auto row =
            std::ranges::upper_bound(ends, ScatteringAngle::between(w, s), before) - ends.begin();
        const double turn = std::atan2(V3d(s).dot(V3d(frame.t)), V3d(s).dot(V3d(frame.s))) / (2 * M_PI);
        const int column = std::min(kColumns - 1, static_cast<int>((turn < 0 ? turn + 1 : turn) * kColumns));
        ++got[static_cast<std::size_t>(row * kColumns + column)];
      }
      tally.expect(fmt::format("{} about ({}, {}, {})", kind.name, w.x, w.y, w.z), expected, got);
    }
  }
  tally.close();
}

TEST(Phases, OtherKindsHaveTheJacobianOfTheirDensity) {
  for (const test::NamedPhase& kind : test::phase_kinds()) {
    if (!kind.one_lobe) continue;  // a mixture maps several random numbers to the same direction
    for (const V3& w : kWays)
      test::expect_jacobian(kind.name, [&](const V2& u) -> std::optional<test::Mapped> {
        const auto s = kind.all.sample(kind.which, V3(0), w, u);
        return test::Mapped{V3d(s.w), double{s.of.pdf}};
      });
  }
}

TEST(Phases, SamplingJacobianIsOneOverTheDensity) {
  for (const V3& w : kWays)
    for (const float g : {-.9f, -.3f, 0.f, .5f, .95f})
      test::expect_jacobian(fmt::format("g {}", g), [&](const V2& u) -> std::optional<test::Mapped> {
        const PhaseSample s = HenyeyGreenstein{g}.sample(w, u);
        return test::Mapped{V3d(s.w), double{s.pdf}};
      });
}

}  // namespace
}  // namespace ls::render
