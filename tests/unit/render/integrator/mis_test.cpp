// Tests the MIS weights of strategies that find the same light. The mean is right with every heuristic. So
// the tests compare the weights themselves, and the second moment of a sample, which has a closed form if
// both densities are known.
#include "worker/render/integrator/mis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "worker/render/integrator/equiangular.h"
#include "worker/render/integrator/segment_nee.h"

namespace ls::render {
namespace {

using test::kPi;
using test::SceneBuilder;
using test::operator*;

TEST(MisWeight, MatchesItsHeuristic) {
  EXPECT_FLOAT_EQ(balance_weight(1, 3), .25f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::balance, 1, 3), .25f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::power, 1, 3), .1f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::power, 3, 1), .9f);
  EXPECT_EQ(mis_weight(MisHeuristic::power, 1, 0), 1);
}

// The first two moments of the first samples of all pixels, which are independent.
struct TwoMoments {
  double mean = 0, square = 0, mean_error = 0, square_error = 0;
};
constexpr int kSide = 256;
TwoMoments two_moments(const SceneBuilder& builder) {
  const auto world = test::world_of(builder);
  constexpr double n = double{kSide} * kSide;
  double sum[5] = {};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double v = render_sample(*world, x, y, 0).rgb[1];
      for (int power = 1; power <= 4; ++power) sum[power] += std::pow(v, power) / n;
    }
  return {sum[1], sum[2], std::sqrt((sum[2] - sum[1] * sum[1]) / n),
          std::sqrt((sum[4] - sum[2] * sum[2]) / n)};
}

template <class F>
double integrated(double from, double to, F f) {
  constexpr int kSteps = 20'000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += f(from + (to - from) * (i + .5) / kSteps);
  return sum * (to - from) / kSteps;
}

// Both moments must be within five standard errors; each check fails by chance with probability 6e-7.
void expect_moments(const TwoMoments& m, double mean, double square) {
  EXPECT_NEAR(m.mean, mean, 5 * m.mean_error);
  EXPECT_NEAR(m.square, square, 5 * m.square_error);
}

// A floor of albedo a in the middle of a ball that emits radiance 1. Let c be the cosine of a direction to
// the normal. Light sampling draws directions uniformly, p_l = 1 / (4 pi), and BSDF sampling by p_s = c / pi.
// With the balance heuristic each strategy contributes a p_s / (p_l + p_s) = a g(c), g = 4 c / (1 + 4 c):
// next-event estimation for the half of its directions above the floor, whose c is uniform, and BSDF sampling
// for c of density 2 c. With the power heuristic the squares would add up to 1.5 times as much for the one
// strategy and to a fifth more for the other.
TEST(MisWeight, SurfacesUseTheBalanceHeuristic) {
  constexpr double kAlbedo = .5;
  SceneBuilder builder({kSide, kSide});
  builder.lamp(SphereShape{}, {}).flip_normals = true;
  builder.shape(RectangleShape{}, test::scale(.01), builder.diffuse(kAlbedo));
  builder.look({0, 0, .5}, {0, 0, 0}, 1e-3, {0, 1, 0});
  builder.scene.integrator.max_depth = 2;
  const auto g = [](double c) { return 4 * c / (1 + 4 * c); };
  const double lit = integrated(0, 1, g) / 2,
               lit2 = integrated(0, 1, [&](double c) { return g(c) * g(c); }) / 2;
  const double found = integrated(0, 1, [&](double c) { return 2 * c * g(c); }),
               found2 = integrated(0, 1, [&](double c) { return 2 * c * g(c) * g(c); });

  const TwoMoments m = two_moments(builder);

  expect_moments(m, kAlbedo, kAlbedo * kAlbedo * (lit2 + found2 + 2 * lit * found));
}

// A lamp stands beside a ray through a cube of a medium, in which light is scattered once. One point of the
// ray is sampled by depth, with density e_D, and one by angle, with density e_A. If the single-scattered
// light is f(t), a strategy with weight w and density e has the second moment int w^2 f^2 / e dt. The lamp is
// so far from the ray that the second moments of the two heuristics differ by fifteen standard errors.
TEST(MisWeight, SegmentsUseTheRequestedHeuristic) {
  constexpr float kSigma = 2, kAside = .4f, kAlong = .7f;
  const auto f = [](double t) {
    const double r = std::hypot(t - kAlong, kAside);
    return kSigma * std::exp(-kSigma * (t + r)) / (4 * kPi * r * r);
  };
  const EquiAngular by_angle({0, 0, 0}, {1, 0, 0}, 1, V3(kAlong, kAside, 0));
  const double light = integrated(0, 1, f);
  for (const MisHeuristic heuristic : {MisHeuristic::power, MisHeuristic::balance}) {
    SceneBuilder builder({kSide, kSide});
    builder.container(CubeShape{}, test::translate({.5, .5, .5}) * test::scale(.5), builder.null(),
                      builder.homogeneous({kSigma, kSigma, kSigma}, {1, 1, 1}));
    builder.scene.emitters.push_back(PointEmitter{{kAlong, .5 + kAside, .5}, {1, 1, 1}});
    builder.look({-1, .5, .5}, {0, .5, .5}, 1e-5);
    builder.scene.integrator.name = "volpath_distant_mis";
    builder.scene.integrator.heuristic = heuristic;
    builder.scene.integrator.max_depth = 2;
    double square = 0, part[2];
    for (const bool angle : {false, true}) {
      const auto weight = [&](double t, double& own) {
        const double d = truncated_pdf(kSigma, 1, static_cast<float>(t)),
                     a = by_angle.pdf(static_cast<float>(t));
        const double other = angle ? d : a, power = heuristic == MisHeuristic::power ? 2 : 1;
        own = angle ? a : d;
        return 1 / (1 + std::pow(other / own, power));
      };
      double own = 0;
      part[angle ? 1 : 0] = integrated(0, 1, [&](double t) { return weight(t, own) * f(t); });
      square += integrated(0, 1, [&](double t) { return std::pow(weight(t, own) * f(t), 2) / own; });
    }

    const TwoMoments m = two_moments(builder);

    expect_moments(m, light, square + 2 * part[0] * part[1]);
  }
}

}  // namespace
}  // namespace ls::render
