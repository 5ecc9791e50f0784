// The choice of a light by place: its probabilities, the formula that they follow, and unusual input.
#include "worker/render/lights/local_lights.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

constexpr std::array<double, 3> kTable{.6, .3, .1};

// Three lights: the first reaches places with x < 0, the second those with x > 0, the third none.
LightVisits two_rooms(int count) {
  RandomStream random(5);
  LightVisits visits;
  for (int i = 0; i < count; ++i) {
    const V3 p(2 * random.uniform() - 1, random.uniform(), random.uniform());
    V3 n(0);
    n[i % 3] = i % 2 == 0 ? 1.f : -1.f;
    visits.add(p, n, p.x < 0 ? std::array{5.f, 0.f, 0.f} : std::array{0.f, .01f, 0.f});
  }
  return visits;
}

TEST(LocalLights, AreChosenWhereTheyReach) {
  const LocalLights lights(two_rooms(20000), kTable);
  for (const V3& n : {V3(1, 0, 0), V3(0, -1, 0), V3(.1f, .2f, .9f)}) {
    // The table of all lights keeps a quarter of the probability
    EXPECT_NEAR(lights.probability(0, {-.5f, .5f, .5f}, n), .75 + .25 * .6, .01);
    EXPECT_NEAR(lights.probability(1, {.5f, .5f, .5f}, n), .75 + .25 * .3, .01);
    EXPECT_NEAR(lights.probability(2, {.5f, .5f, .5f}, n), .25 * .1, 1e-6);
  }
}

TEST(LocalLights, AreSampledWithTheirStatedProbability) {
  const LocalLights lights(two_rooms(2000), kTable);
  RandomStream random(9);
  for (int i = 0; i < 200; ++i) {
    const V3 p(4 * random.uniform() - 2, 4 * random.uniform() - 2, random.uniform());
    const V3 n(random.uniform() - .5f, random.uniform() - .5f, random.uniform() - .5f);
    // The words of each light are consecutive, so the first and the last word of each light are tried
    double before = 0;
    for (std::uint32_t l = 0; l < 3; ++l) {
      const float probability = lights.probability(l, p, n);
      EXPECT_GE(probability, .25 * kTable[l] * (1 - 1e-6));
      const double first = before, end = before + double{probability};
      for (const double at : {first + 1e-6, end - 1e-6}) {
        const DrawnLight drawn = lights.draw(static_cast<std::uint32_t>(at * 0x1p32), p, n);
        EXPECT_EQ(drawn.light, l);
        EXPECT_EQ(drawn.probability, probability);
      }
      before = end;
    }
    EXPECT_NEAR(before, 1, 1e-6);
  }
}

TEST(LocalLights, FollowTheSquareRootOfTheMeanSquare) {
  // At every fourth place the first light brings 9/10 of the light and the second 1/10; at all other places
  // the second brings all of it
  LightVisits visits;
  for (int i = 0; i < 4000; ++i)
    visits.add({static_cast<float>(i) * 1e-3f, 0, 0}, {0, 0, 1},
               i % 4 == 0 ? std::array{.9f, .1f, 0.f} : std::array{0.f, 1.f, 0.f});
  const LocalLights lights(visits, kTable);
  const double first = std::sqrt(.25 * .81), second = std::sqrt(.25 * .01 + .75);
  EXPECT_NEAR(lights.probability(0, {2, 0, 0}, {0, 0, 1}), .25 * .6 + .75 * first / (first + second), .02);
}

TEST(LocalLights, KnowMediaOnlyIfTheyWereVisited) {
  LightVisits visits = two_rooms(200);
  EXPECT_FALSE(LocalLights(visits, kTable).in_media());
  for (int i = 0; i < 200; ++i)
    visits.add({-.5f, .5f, .01f * static_cast<float>(i)}, V3(0), std::array{0.f, 0.f, 1.f});
  const LocalLights lights(visits, kTable);
  EXPECT_TRUE(lights.in_media());
  EXPECT_GT(lights.probability(2, {-.5f, .5f, 1}, V3(0)), .6f);
  EXPECT_LT(lights.probability(2, {-.5f, .5f, 1}, {1, 0, 0}), .2f);
}

TEST(LocalLights, HandleUnvisitedSides) {
  LightVisits visits;
  for (int i = 0; i < 1000; ++i)
    visits.add({static_cast<float>(i), 0, 0}, {0, 0, 1}, std::array{1.f, 0.f, 0.f});
  const LocalLights lights(visits, kTable);
  EXPECT_NEAR(lights.probability(0, {5, 5, 5}, {0, -1, 0}), .75 + .25 * .6, 1e-6) << "the mean of all visits";
}

TEST(LocalLights, HandleOddVisits) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  LightVisits visits;
  visits.add({0, 0, 0}, {0, 0, 1}, std::array{0.f, 0.f, 0.f});
  visits.add({0, 0, 0}, {0, 0, 1}, std::array{kInfinity, 0.f, 0.f});
  visits.add({0, 0, 0}, {0, 0, 1}, std::array{kNan, 1.f, 0.f});
  visits.add({kNan, 0, 0}, {0, 0, 1}, std::array{1.f, 0.f, 0.f});
  visits.add({0, kInfinity, 0}, {0, 0, 1}, std::array{1.f, 0.f, 0.f});
  EXPECT_TRUE(visits.places.empty()) << "dark, or without a meaning";

  for (int i = 0; i < 1000; ++i) visits.add({1, 2, 3}, {0, 0, 1}, std::array{1.f, 0.f, 0.f});
  // More than half of the places have the smallest coordinate, so a plane at the median cannot separate them
  for (int i = 0; i < 900; ++i)
    visits.add({2, 2, static_cast<float>(i)}, {0, 1, 0}, std::array{i < 500 ? 0.f : 1.f, 1.f, 0.f});
  for (int i = 0; i < 1000; ++i) visits.add({2, 2, 0}, {0, 1, 0}, std::array{0.f, 1.f, 0.f});
  const LocalLights lights(visits, kTable);
  for (const V3& p : {V3(1, 2, 3), V3(2, 2, 700), V3(kNan, 0, 0), V3(-kInfinity)})
    for (const V3& n : {V3(0, 0, 1), V3(0, 1, 0), V3(kNan)}) {
      double sum = 0;
      for (std::uint32_t l = 0; l < 3; ++l) sum += double{lights.probability(l, p, n)};
      EXPECT_NEAR(sum, 1, 1e-6);
    }
  EXPECT_GT(lights.probability(0, {2, 2, 700}, {0, 1, 0}), 2 * lights.probability(0, {2, 2, 0}, {0, 1, 0}));
}

}  // namespace
}  // namespace ls::render
