// The weights of strategies that find the same light. Their mean is right whatever the heuristic: what tells
// one from another is the weights themselves, and the second moment of a sample, which has a closed form
// where both densities are known.
#include "worker/render/integrator/mis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "worker/render/integrator/equiangular.h"
#include "worker/render/integrator/truncated_exponential.h"

namespace ls::render {
namespace {

using test::kPi;
using test::SceneBuilder;
using test::operator*;

TEST(MisWeight, IsThatOfItsHeuristic) {
  EXPECT_FLOAT_EQ(balance_weight(1, 3), .25f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::balance, 1, 3), .25f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::power, 1, 3), .1f);
  EXPECT_FLOAT_EQ(mis_weight(MisHeuristic::power, 3, 1), .9f);
  EXPECT_EQ(mis_weight(MisHeuristic::power, 1, 0), 1);
}

// Of independent samples, the first of each pixel.
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

// Within five of their standard errors: 6e-7 each.
void expect_moments(const TwoMoments& m, double mean, double square) {
  EXPECT_NEAR(m.mean, mean, 5 * m.mean_error);
  EXPECT_NEAR(m.square, square, 5 * m.square_error);
}

// A floor in the middle of a ball that shines 1. Light is sampled over all directions alike, so p_l = 1 / (4
// pi), the floor's directions with p_s = c / pi, c their cosine. By the balance heuristic either way brings
// a p_s / (p_l + p_s) = a g(c), g = 4 c / (1 + 4 c): next-event estimation for half of its directions, of
// which c is uniform, and found light for c of density 2 c. By the power heuristic squares would add up to
// 1.5 times as much in the one way and a fifth more in the other.
TEST(MisWeight, AtSurfacesIsTheBalanceHeuristic) {
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

// A lamp beside a ray through a cube of a medium, whose light is scattered once: a point of the ray is drawn
// by depth, of density e_D, and another by angle, of density e_A. What light f(t) either brings has the
// second moment of w^2 f^2 / e^2. With the lamp as far aside as here, those of the two heuristics
// are fifteen standard errors apart.
TEST(MisWeight, AlongSegmentsIsThatWhichIsAskedFor) {
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
