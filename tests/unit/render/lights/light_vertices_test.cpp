#include "worker/render/lights/light_vertices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <thread>

#include "worker/render/math/random.h"

#include "core/image/error/area_error.h"
namespace ls::render {
namespace {

SunMap learned() {
  SunMap map(normalize(V3(.3f, -1, .2f)), 2);
  map.learn({.1f, .2f, .3f}, 5);
  map.learn({-.7f, .1f, 1}, 1);
  map.finish();
  return map;
}

TEST(SunMap, IsEmptyUntilTheSunIsFound) {
  SunMap map({0, 0, 1}, 1);
  map.learn({0, 0, 0}, 0);
  map.learn({0, 0, 0}, std::numeric_limits<float>::quiet_NaN());
  map.learn({0, 0, 0}, std::numeric_limits<float>::infinity());
  map.finish();
  EXPECT_TRUE(map.empty());
  EXPECT_FALSE(learned().empty());
}

// A ray has the density of all points on it, and the mean of 1 / density over rays is the area of the plane.
TEST(SunMap, RayDensityMatchesItsPoints) {
  const SunMap map = learned();
  RandomStream random(7);
  double area = 0, squares = 0;
  constexpr int kRays = 200000;
  for (int i = 0; i < kRays; ++i) {
    const SunMap::Ray ray = map.sample({random.bits(), random.bits(), random.bits(), random.bits()});
    ASSERT_GT(ray.density, 0);
    EXPECT_LE(dot(ray.o, map.direction()), -2.f) << "starts within the scene";
    const double inverse = 1 / double{ray.density};
    area += inverse / kRays;
    squares += inverse * inverse / kRays;
    // Near the border between two cells rounding may move the point across
    if (i % 100 == 0) {
      const V3 p = ray.o + map.direction() * 2.5f;
      const bool near_border =
          map.density(p) != map.density(p + V3(1e-5f)) || map.density(p) != map.density(p - V3(1e-5f));
      if (!near_border) EXPECT_EQ(map.density(p), ray.density);
    }
  }
  const double error = std::sqrt((squares - area * area) / kRays);
  EXPECT_NEAR(area, 16, 5 * error);  // 5 standard errors: single_figures of significance.h
  EXPECT_LT(error, .2);
}

// The paths saw only a small room of a large scene, so the rays start towards this room.
TEST(SunMap, AimsRaysWhereTheSunWasFound) {
  SunMap map({0, 0, 1}, 1000);
  map.learn({1, 2, 3}, 1);
  map.learn({2, 1, 3}, 1);
  map.finish();
  RandomStream random(5);
  int near = 0;
  for (int i = 0; i < 1000; ++i) {
    const V3 o = map.sample({random.bits(), random.bits(), random.bits(), random.bits()}).o;
    near += std::abs(o.x - 1.5f) < 2 && std::abs(o.y - 1.5f) < 2;
  }
  // About 95 % of the rays: 50 of 1000 start elsewhere, with a standard deviation of 7.
  EXPECT_GT(near, 850);
  EXPECT_GT(map.density({900, 0, 0}), 0);
}

// Compares with the densities of all strategies that find a path of five vertices, of which the sun lights
// the last.
TEST(SubpathDensities, SumOverAllWaysToFindAPath) {
  constexpr std::size_t kLast = 4;
  RandomStream random(5);
  const auto number = [&] { return .1f + random.uniform(); };
  const auto vector = [&] { return V3(number(), -number(), number()); };
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::array<V3, kLast + 1> v, n;
    // Densities of directions at each vertex: `ahead`, with which the camera samples the next vertex, and
    // `back`, with which the sun samples the previous one
    std::array<float, kLast + 1> ahead{}, back{};
    for (std::size_t i = 0; i <= kLast; ++i) {
      v[i] = vector();
      n[i] = (repeat + static_cast<int>(i)) % 3 == 0 ? V3(0) : normalize(vector());  // 0: in a medium
      ahead[i] = number();
      back[i] = number();
    }
    const float first_lit = number();  // the density of the first vertex after the sun
    const auto of_vertex = [&](std::size_t i, std::size_t from, float pdf) {
      const V3 f = v[i] - v[from];
      const float r2 = dot(f, f);
      return pdf / r2 * (is_black(n[i]) ? 1 : std::abs(dot(n[i], f)) / std::sqrt(r2));
    };
    const auto by_camera = [&](std::size_t i) { return of_vertex(i, i - 1, ahead[i - 1]); };
    const auto by_sun = [&](std::size_t i) {
      return i == kLast ? first_lit : of_vertex(i, i + 1, back[i + 1]);
    };
    std::array<SubpathDensities, kLast + 1> camera, sun;
    for (std::size_t i = 1; i <= kLast; ++i)
      camera[i] = SubpathDensities::extended(v[i] - v[i - 1], ahead[i - 1], camera[i - 1].sum(back[i - 1]),
                                             n[i], n[i - 1]);
    sun[kLast] = {1 / first_lit, 0};
    for (std::size_t i = kLast; i-- > 0;)
      sun[i] = SubpathDensities::extended(v[i] - v[i + 1], back[i + 1], sun[i + 1].sum(ahead[i + 1]), n[i],
                                          n[i + 1]);
    // The density of each strategy k, in which the camera samples vertices 0 to k
    std::array<double, kLast + 1> density;
    double all = 0;
    for (std::size_t k = 0; k <= kLast; ++k) {
      density[k] = 1;
      for (std::size_t i = 1; i <= kLast; ++i) density[k] *= double{i <= k ? by_camera(i) : by_sun(i)};
      all += density[k];
    }
    for (std::size_t k = 0; k <= kLast; ++k) {
      double others = k > 0 ? double{by_sun(k) * camera[k].sum(back[k])} : 0;
      if (k < kLast) others += double{by_camera(k + 1) * sun[k + 1].sum(ahead[k + 1])};
      // Each float operation has an error of at most 6e-8, and there are fewer than a hundred operations
      EXPECT_NEAR((1 + others) * density[k] / all, 1, 1e-5) << k;
    }
  }
}

// Light vertices around the origin; kCandidates of them fill a block.
LightVertices some(std::size_t count) {
  LightVertices all;
  RandomStream random(3);
  for (std::size_t i = 0; i < count; ++i) {
    LightVertex y;
    y.p = {random.uniform() * 2 - 1, random.uniform() * 2 - 1, random.uniform() - 2};
    if (i % 3 == 0) y.medium = 0;
    LightVertices::Look look;
    look.n = y.medium == kNone ? V3(0, 0, 1) : V3(0);
    look.g = .5f;
    (y.medium == kNone ? look.even : look.lobe) = .1f + random.uniform();
    if (i % 5 == 0) look.lobe = random.uniform();
    look.density = 1 + random.uniform();
    all.add(y, look);
  }
  all.finish();
  return all;
}

// The weight is 1 over the expected number of times that a vertex is chosen. With u on a grid of kSteps
// points, the share of u for which a vertex is chosen is off by at most 2 / kSteps.
TEST(LightVertices, AreChosenWithTheProbabilityUsedInTheirWeight) {
  constexpr std::size_t kCount = LightVertices::kCandidates + 11;
  constexpr int kSteps = 20000;
  const LightVertices all = some(kCount);
  Receiver surface, medium;
  surface.p = {.1f, .2f, .3f};
  surface.n = {0, 0, -1};
  medium.p = surface.p;
  medium.d = normalize(V3(.3f, .1f, -1));
  medium.g = .7f;
  medium.in_medium = true;
  for (const Receiver& x : {surface, medium}) {
    std::map<const LightVertex*, std::pair<double, double>> seen;  // share of choices and weight
    for (const std::uint32_t block : {0u, 0x80000000u})
      for (int i = 0; i < kSteps; ++i) {
        const auto c = all.choose(x, block, (static_cast<float>(i) + .5f) / kSteps);
        ASSERT_TRUE(c.vertex);
        auto& [share, weight] = seen[c.vertex];
        share += .5 / kSteps;
        weight = c.weight;
      }
    EXPECT_EQ(seen.size(), kCount);
    for (const auto& [vertex, s] : seen) EXPECT_NEAR(s.first * s.second, 1, s.second * 2 / kSteps + 1e-4);
  }
}

TEST(LightVertices, ThoseBehindASurfaceAreNotChosen) {
  Receiver x;
  x.p = {0, 0, 1};
  x.n = {0, 0, 1};
  EXPECT_FALSE(some(5).choose(x, 0, .5f).vertex);
  x.both_sides = true;
  EXPECT_TRUE(some(5).choose(x, 0, .5f).vertex);
  EXPECT_FALSE(LightVertices().choose(x, 0, .5f).vertex) << "there are none";
}

TEST(LightVertices, AreSeenFromTheSidesThatTheyLight) {
  for (const bool both_sides : {false, true}) {
    LightVertices all;
    LightVertex y;
    LightVertices::Look look;
    look.n = {0, 0, 1};
    look.both_sides = both_sides;
    look.even = look.density = 1;
    all.add(y, look);
    all.finish();
    for (const float z : {-1.f, 1.f}) {
      Receiver x;
      x.p = {0, 0, z};
      x.n = {0, 0, -z};
      EXPECT_EQ(all.choose(x, 0, .5f).vertex != nullptr, z > 0 || both_sides) << z;
    }
  }
}

TEST(LightVertices, ThoseAtTheReceiverItselfAreHandled) {
  LightVertices all;
  LightVertex y;
  y.medium = 0;
  LightVertices::Look look;
  look.even = look.density = 1;
  all.add(y, look);
  all.finish();
  Receiver surface, medium;
  surface.n = {0, 0, -1};
  medium.d = {0, 0, 1};
  medium.in_medium = true;
  EXPECT_FALSE(all.choose(surface, 0, .5f).vertex) << "it is in the surface's plane";
  const auto c = all.choose(medium, 0, .5f);
  ASSERT_TRUE(c.vertex);
  EXPECT_FLOAT_EQ(c.weight, 1);
}

// With g so close to 1, the denominator of the phase function consists of rounding errors.
TEST(LightVertices, ThoseInForwardScatteringMediaAreChosen) {
  for (const float g : {-.99999f, .9995f, .9999f, .99999f}) {
    LightVertices all;
    LightVertex y;
    y.medium = 0;
    LightVertices::Look look;
    look.lobe = look.density = 1;
    look.g = g;
    all.add(y, look);
    all.finish();
    Receiver x;
    x.in_medium = true;
    x.g = g;
    for (const float z : {-1.f, 1.f}) {
      x.p = {0, 0, z};
      x.d = {0, 0, -z};
      const auto c = all.choose(x, 0, .5f);
      ASSERT_TRUE(c.vertex) << g;
      EXPECT_FLOAT_EQ(c.weight, 1) << g;
    }
  }
}

// Two vertices are at the same place, and one of them also shines upwards through a lobe.
TEST(LightVertices, AreChosenByTheirLobes) {
  LightVertices all;
  LightVertex y;
  LightVertices::Look look;
  look.n = {0, 0, 1};
  look.even = look.density = 1;
  all.add(y, look);
  look.lobe = 2;
  look.axis = {0, 0, -1};
  look.g = .5f;
  all.add(y, look);
  all.finish();
  for (const float cosine : {1.f, .5f, .1f}) {
    Receiver x;
    x.p = {std::sqrt(1 - cosine * cosine), 0, cosine};
    x.n = -x.p;
    const auto last = all.choose(x, 0, .9999f);
    const double lobe = .75 / std::pow(1.25 - double{cosine}, 1.5);
    const double even = double{cosine}, both = even + 2 * lobe;  // radiances times cosine of the two vertices
    const double any = .1 * (even + both) / LightVertices::kCandidates;  // a tenth is shared among all lanes
    EXPECT_NEAR(double{last.weight} * (both + any) / (even + both + 2 * any), 1, 1e-5) << cosine;
  }
}

static_assert(LightVertexCache::kEpoch == kSetSamples,
              "intervals of the image's mean are for another length");

TEST(LightVertexCache, EachHalfAndEpochHasASeparateSet) {
  constexpr std::uint64_t e = LightVertexCache::kEpoch;
  EXPECT_NE(LightVertexCache::set_of(0), LightVertexCache::set_of(1));
  EXPECT_EQ(LightVertexCache::set_of(0), LightVertexCache::set_of(e - 2));
  EXPECT_NE(LightVertexCache::set_of(0), LightVertexCache::set_of(e));
  EXPECT_NE(LightVertexCache::set_of(1), LightVertexCache::set_of(e));
}

TEST(LightVertexCache, BuildsASetOnceForAllThreads) {
  LightVertexCache cache;
  std::atomic<int> built{0};
  const auto build = [&](std::uint64_t) {
    ++built;
    return some(3);
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back([&] { EXPECT_EQ(cache.get(5, build)->count(), 3u); });
  }
  EXPECT_EQ(built, 1);
  const auto kept = cache.get(5, build);
  for (std::uint64_t set = 10; set < 30; ++set) cache.get(set, build);
  EXPECT_EQ(built, 21);
  EXPECT_EQ(kept->count(), 3u) << "whoever has a set keeps it";
  cache.get(5, build);
  EXPECT_EQ(built, 22) << "sets that nobody uses are dropped";
}

}  // namespace
}  // namespace ls::render
