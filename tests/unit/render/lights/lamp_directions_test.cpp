// Directions near lamps: their density, their samples, and the second moment, which they make finite.
#include "worker/render/lights/lamp_directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

const V3 kVertex(.5f, -1, 2);

Lamps lamps(std::initializer_list<V3> positions) {
  Lamps all;
  for (const V3& p : positions) all.position[all.count++] = p;
  return all;
}

// The mean, and its standard error, of value(w, density of w) over directions w of a mixture whose own
// distribution is uniform.
struct Mean {
  double value = 0, error = 0;
};
template <class Value>
Mean mean_of(const LampDirections& directions, Value value) {
  RandomStream random(7);
  constexpr int kSamples = 1 << 20;
  double sum = 0, squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    float choice = random.uniform();
    const V2 u(random.uniform(), random.uniform());
    V3 w;
    if (const auto near = directions.sample(choice, u)) {
      w = *near;
    } else {
      EXPECT_TRUE(choice >= 0 && choice < 1);
      const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
      w = {r * unit_circle(u.y).x, r * unit_circle(u.y).y, z};
    }
    const double v = value(w, directions.pdf(kInvFourPi, w));
    sum += v;
    squares += v * v;
  }
  const double mean = sum / kSamples;
  return {mean, std::sqrt((squares / kSamples - mean * mean) / kSamples)};
}

// The mean of a function over the density is the integral of the function if, and only if, the samples have
// this density. Each test allows five standard errors, which are exceeded with probability 6e-7.
TEST(LampDirections, HaveTheirStatedDensity) {
  for (const Lamps& all : {lamps({{1, 2, 3}}), lamps({{1, 2, 3}, {-4, 0, 1}, {.5f, -1, 2.1f}})}) {
    const LampDirections directions(all, kVertex);
    ASSERT_TRUE(directions.any());
    const Mean sphere = mean_of(directions, [](const V3&, double pdf) { return 1 / pdf; });
    EXPECT_NEAR(sphere.value, 4 * M_PI, 5 * sphere.error);
    const Mean cosine = mean_of(directions, [](const V3& w, double pdf) { return std::max(0.f, w.x) / pdf; });
    EXPECT_NEAR(cosine.value, M_PI, 5 * cosine.error);
    const Mean square = mean_of(directions, [](const V3& w, double pdf) { return w.y * w.y / pdf; });
    EXPECT_NEAR(square.value, 4 * M_PI / 3, 5 * square.error);
  }
}

// Light near a lamp grows as 1 / sin(theta), where theta is the angle to the lamp. The test compares the
// sampled second moment of this function with a quadrature over theta. With uniform directions alone it would
// be infinite.
TEST(LampDirections, BoundTheSecondMomentOfLightNearALamp) {
  const LampDirections directions(lamps({{1, 2, 3}}), kVertex);
  const V3 to_lamp = normalize(V3(1, 2, 3) - kVertex);
  double expected = 0;
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const double sine = std::sin(M_PI * (i + .5) / kSteps);
    const double pdf = (1 - kLampShare) / (4 * M_PI) + kLampShare / (2 * M_PI * M_PI * sine);
    expected += M_PI / kSteps * 2 * M_PI * sine / (sine * sine * pdf);
  }
  const Mean found = mean_of(directions, [&](const V3& w, double pdf) {
    const V3 c = cross(to_lamp, w);
    return 1 / (dot(c, c) * pdf * pdf);
  });
  EXPECT_NEAR(found.value, expected, 5 * found.error);
}

TEST(LampDirections, KeepThePhaseFunctionWithoutALamp) {
  for (const LampDirections& none : {LampDirections(), LampDirections(lamps({kVertex}), kVertex)}) {
    float choice = .1f;
    EXPECT_FALSE(none.any());
    EXPECT_FALSE(none.sample(choice, {.3f, .7f}));
    EXPECT_EQ(choice, .1f);
    EXPECT_EQ(none.pdf(.125f, {0, 0, 1}), .125f);
    EXPECT_EQ(none.own_share(), 1);
  }
}

TEST(LampDirections, StayFiniteStraightTowardsALampAndAwayFromIt) {
  const LampDirections directions(lamps({{0, 0, 1}}), {0, 0, 0});
  for (const float z : {1.f, -1.f}) {
    EXPECT_GT(directions.pdf(kInvFourPi, {0, 0, z}), 1e3f);
    EXPECT_TRUE(std::isfinite(directions.pdf(kInvFourPi, {0, 0, z})));
  }
  for (const float u : {0.f, .5f, 0x1.fffffep-1f}) {
    float choice = 0;
    const auto w = directions.sample(choice, {u, u});
    ASSERT_TRUE(w);
    EXPECT_NEAR(dot(*w, *w), 1, 1e-6);
  }
}

}  // namespace
}  // namespace ls::render
