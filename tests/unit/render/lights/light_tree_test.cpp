// The tree of many lights: its probabilities are exact, and it reduces noise.
#include "worker/render/lights/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;
using test::translate;

constexpr std::uint64_t kWords = std::uint64_t{1} << 32;

// Lights of all kinds, of strengths from 1 to 1000, in a hall 20 units wide, and a sun.
SceneBuilder hall(int lights) {
  SceneBuilder builder;
  const BsdfIndex floor = builder.diffuse(.5), black = builder.diffuse(0);
  builder.shape(RectangleShape{}, test::scale(10), floor);
  RandomStream r(17);
  const auto in = [&](double low, double high) { return low + (high - low) * r.uniform(); };
  for (int i = 0; i < lights; ++i) {
    const Vec3 at{in(-10, 10), in(-10, 10), in(1, 6)};
    const double power = std::pow(10, in(0, 3)) * 1e-2;
    const Rgb colour{power, power * in(.3, 1), power};
    const Transform turned = translate(at) * test::rotate_x(in(90, 270)) * test::rotate_y(in(-60, 60));
    const auto shine = [&](const ls::Geometry& g, double size) -> AreaEmitter& {
      const TextureIndex radiance = builder.texture(colour);
      Shape& s = builder.shape(g, turned * test::scale(size), black);
      return s.emitter.emplace(AreaEmitter{radiance});
    };
    switch (i % 7) {
      case 0:
        shine(RectangleShape{}, .3);
        break;
      case 1:
        shine(DiskShape{}, .2);
        break;
      case 2:
        shine(SphereShape{}, .1);
        break;
      case 3:
        shine(CubeShape{}, .1);
        break;
      case 4:
        builder.scene.emitters.push_back(PointEmitter{at, colour});
        break;
      case 5:
        builder.scene.emitters.push_back(SpotEmitter{turned, colour, 50, 20, {}});
        break;
      default: {
        AreaEmitter& beam = shine(RectangleShape{}, .2);
        beam.cutoff_angle = 40;
        beam.beam_width = 20;
      }
    }
  }
  builder.scene.emitters.push_back(DirectionalEmitter{{0, .3, -1}, {.1, .1, .1}, 1});
  return builder;
}
V3 random_direction(RandomStream& r) {
  const float z = 2 * r.uniform() - 1;
  const V2 c = unit_circle(r.uniform()) * safe_sqrt(1 - z * z);
  return {c.x, c.y, z};
}

std::vector<LightBounds> random_bounds(std::size_t n, RandomStream& r) {
  std::vector<LightBounds> all(n);
  for (LightBounds& b : all) {
    const V3 p(r.uniform(), r.uniform(), r.uniform()), e(.1f * r.uniform(), 0, .1f * r.uniform());
    b.low = p - e;
    b.high = p + e;
    b.axis = random_direction(r);
    b.cos_spread = r.uniform() < .3f ? -1.f : r.uniform();
    b.cos_reach = r.uniform() < .5f ? 0.f : r.uniform();
    b.intensity = std::pow(10., 6 * r.uniform() - 3);
  }
  return all;
}

TEST(LightTree, DividesAllRandomNumbersAmongItsLights) {
  RandomStream r(1);
  for (const std::size_t n : {1u, 2u, 3u, 50u, 1000u}) {
    const LightTree tree = LightTree::build(random_bounds(n, r));
    for (int k = 0; k < 20; ++k) {
      const V3 x(2 * r.uniform(), r.uniform(), r.uniform()), normal = k % 2 ? random_direction(r) : V3(0);
      for (const std::uint64_t words : {std::uint64_t{7}, std::uint64_t{12345}, kWords}) {
        std::uint64_t sum = 0;
        for (std::uint32_t i = 0; i < n; ++i) sum += tree.words_of(i, words, x, normal);
        ASSERT_EQ(sum, words) << n;
        for (int j = 0; j < 20; ++j) {
          const auto word = static_cast<std::uint64_t>(r.uniform() * static_cast<double>(words));
          const LightTree::Found f = tree.find(word, words, x, normal);
          ASSERT_GE(f.words, 1u);
          ASSERT_EQ(f.words, tree.words_of(f.light, words, x, normal));
        }
      }
    }
  }
}

// Each light is found by exactly as many words as words_of() returns.
TEST(LightTree, SelectsEachLightForItsShareOfRandomNumbers) {
  RandomStream r(2);
  constexpr std::uint64_t words = 5000;
  const LightTree tree = LightTree::build(random_bounds(40, r));
  for (int k = 0; k < 5; ++k) {
    const V3 x(r.uniform(), r.uniform(), -.2f), normal = random_direction(r);
    std::vector<std::uint64_t> count(40, 0);
    for (std::uint64_t w = 0; w < words; ++w) ++count[tree.find(w, words, x, normal).light];
    for (std::uint32_t i = 0; i < 40; ++i) EXPECT_EQ(count[i], tree.words_of(i, words, x, normal));
  }
}

TEST(LightTree, PrefersNearAndBrightLightsThatFaceThePoint) {
  const auto share = [](LightBounds a, LightBounds b, const V3& n) {
    const LightTree tree = LightTree::build({a, b});
    return static_cast<double>(tree.words_of(0, kWords, V3(0), n)) / static_cast<double>(kWords);
  };
  const auto at = [](const V3& p, double intensity) {
    LightBounds b;
    b.low = b.high = p;
    b.intensity = intensity;
    return b;
  };
  const V3 up(0, 0, 1);
  EXPECT_NEAR(share(at({1, 0, 0}, 1), at({-1, 0, 0}, 3), V3(0)), 1. / 4, 1e-6) << "intensity";
  EXPECT_NEAR(share(at({0, 0, 1}, 1), at({0, 0, 3}, 1), up), 9. / 10, 1e-6) << "distance";
  const double c = std::sqrt(.5);
  EXPECT_NEAR(share(at({0, 0, 1}, 1), at({0, float(c), float(c)}, 1), up), 1 / (1 + c), 1e-6) << "cosine";
  EXPECT_NEAR(share(at({0, 0, 1}, 1), at({0, float(c), float(c)}, 1), V3(0)), .5, 1e-6) << "in a medium";
  LightBounds turned = at({0, 0, 1}, 1), away = turned;
  turned.cos_spread = away.cos_spread = 1;
  turned.axis = {0, 0, -1};
  EXPECT_EQ(share(turned, away, up), 1) << "away";
}

TEST(LightTree, HandlesCoincidentAndExtremeLights) {
  LightBounds b;
  b.low = b.high = V3(.5f);
  b.intensity = 1e-30;
  std::vector<LightBounds> same(3000, b);
  for (std::size_t i = 0; i < same.size(); i += 2) same[i].intensity = 1e30;
  const LightTree tree = LightTree::build(same);
  for (const V3& x : {V3(.5f), V3(1e8f, 0, 0), V3(.5f, .5f, .5f + 1e-6f)}) {
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < same.size(); ++i) sum += tree.words_of(i, kWords, x, {0, 0, 1});
    EXPECT_EQ(sum, kWords);
  }
}

// A million lights have intensities from 1e-20 to 1e20. All words are given to lights. A light gets no word
// only where its node has fewer words than lights, so the lost intensity is at most one word's share per
// light (here 4e-7 of the sum). Lights below 1e9 have 1e-10 of the total intensity and get at most one word
// each, 2.3e-4 of all words; so at most ten of a thousand words find such a light.
TEST(LightTree, DividesRandomNumbersAmongAMillionVeryUnequalLights) {
  constexpr std::size_t n = 1'000'000;
  RandomStream r(30);
  std::vector<LightBounds> lights = random_bounds(n, r);
  for (std::size_t i = 0; i < n; ++i) {
    lights[i].intensity = std::pow(10., 40 * r.uniform() - 20);
    lights[i].cos_spread = -1;  // all shine in all directions
  }
  const LightTree tree = LightTree::build(lights);
  const V3 x(.5f, .5f, 2);
  std::uint64_t sum = 0;
  double lost = 0, all = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint64_t words = tree.words_of(i, kWords, x, V3(0));
    sum += words;
    all += lights[i].intensity;
    if (words == 0) lost += lights[i].intensity;
  }
  EXPECT_EQ(sum, kWords);
  EXPECT_LT(lost / all, static_cast<double>(n) / static_cast<double>(kWords));
  int dim = 0;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    const LightTree::Found f = tree.find(k * (kWords / 1000), kWords, x, V3(0));
    ASSERT_EQ(f.words, tree.words_of(f.light, kWords, x, V3(0)));
    ASSERT_GE(f.words, 1u);
    dim += lights[f.light].intensity < 1e9;
  }
  EXPECT_LE(dim, 10);
}

// The tree as a part of Lights
TEST(ManyLights, ProbabilitiesSumToOneAndMatchTheSampling) {
  const LightBench b(hall(200));
  const Lights& lights = b.world->lights;
  ASSERT_TRUE(lights.has_tree());
  RandomStream r(4);
  for (int k = 0; k < 10; ++k) {
    const V3 x = b.at({20 * r.uniform() - 10., 20 * r.uniform() - 10., 3. * r.uniform()});
    const V3 n = k % 3 ? random_direction(r) : V3(0);
    // Every 2^16-th word is tried. That is enough, because the words of a light form at most two runs.
    std::vector<double> seen(lights.count(), 0), said(lights.count(), 0);
    constexpr int kProbes = 1 << 16;
    for (int i = 0; i < kProbes; ++i) {
      const LightChoice c = lights.choose({static_cast<std::uint32_t>(i) << 16, 0, 0}, {x, n});
      seen[c.light] += 1. / kProbes;
      if (said[c.light] > 0) {
        ASSERT_EQ(said[c.light], c.probability) << "whichever way it is found";
      }
      said[c.light] = c.probability;
    }
    double sum = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      sum += said[i];
      EXPECT_NEAR(seen[i], said[i], 3. / kProbes) << i;  // at each of two runs, at most one probe is off
    }
    EXPECT_NEAR(sum, 1, 200. / kProbes) << "but for those that no probe met";
  }
}

TEST(ManyLights, HitHasTheDensityOfItsSample) {
  const LightBench b(hall(150));
  const Lights& lights = b.world->lights;
  RandomStream r(6);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const V3 x = b.at({20 * r.uniform() - 10., 20 * r.uniform() - 10., .5}), n = random_direction(r);
    const auto s = lights.sample(lights.choose(numbers(r.uniform(), r.uniform(), r.uniform()), {x, n}), x);
    if (!s || s->delta || !std::isfinite(s->distance)) continue;
    const auto primitive = b.world->accel.nearest(x, s->direction, kInfinity);
    SurfaceHit hit;
    if (!primitive || !b.world->geometry.complete(*primitive, x, s->direction, hit)) continue;
    if (std::abs(hit.t - s->distance) > 1e-5f) continue;  // another surface is in front of the light
    const float c = std::abs(dot(hit.ng, s->direction));
    if (c < .1f) continue;
    ++hits;
    // The sampled point is 2^-20 of the world's size off the light's surface, at distances of at least 1/60
    // of that size.
    ASSERT_NEAR(lights.pdf(hit, x, s->direction, {x, n}) / s->pdf, 1, 2e-4 / c);
  }
  EXPECT_GT(hits, 1000);
}

// Mean and variance of the values of one way of choosing lights.
struct Moments {
  double sum = 0, square = 0;
  int n = 0;
  void add(double v) { sum += v, square += v * v, ++n; }
  double mean() const { return sum / n; }
  double variance() const { return square / n - mean() * mean(); }
  double error() const { return std::sqrt(variance() / n); }
};

// Returns the variance of the table over that of the tree, as the geometric mean over these points of the
// floor. Also checks that all ways of choosing have the same mean.
double variance_gain(const LightBench& b, const std::vector<Vec3>& places) {
  const Lights& lights = b.world->lights;
  RandomStream r(8);
  double gain = 0;
  for (const Vec3& p : places) {
    const V3 x = b.at({p[0], p[1], p[2]}), n(0, 0, 1);
    Moments table, tree, medium;
    for (int i = 0; i < 60000; ++i) {
      const LightNumbers u = numbers(r.uniform(), r.uniform(), r.uniform());
      const auto value = [&](const LightChoice& c) {
        const auto s = lights.sample(c, x);
        return s ? luminance(s->radiance) * std::max(0.f, s->direction.z) / s->pdf : 0.;
      };
      table.add(value(lights.choose(u)));
      tree.add(value(lights.choose(u, {x, n})));
      medium.add(value(lights.choose(u, {x, V3(0)})));
    }
    EXPECT_NEAR(tree.mean(), table.mean(), 5 * std::hypot(table.error(), tree.error())) << p[0];
    EXPECT_NEAR(medium.mean(), table.mean(), 5 * std::hypot(table.error(), medium.error())) << p[0];
    EXPECT_LT(tree.error(), .02 * tree.mean()) << "or the test says little";
    gain += std::log(table.variance() / tree.variance());
  }
  return std::exp(gain / static_cast<double>(places.size()));
}

TEST(ManyLights, LightTreeIsUnbiasedAndLessNoisyThanTheTable) {
  for (const int n : {40, 150, 500}) {
    const LightBench b(hall(n));
    ASSERT_TRUE(b.world->lights.has_tree());
    const double gain = variance_gain(b, {{0, 0, 0}, {5, -7, 0}, {-9, 9, 0}, {2, 3, 0}});
    RecordProperty("hall_" + std::to_string(n), std::to_string(gain));
    EXPECT_GT(gain, n < 100 ? 1.1 : 1.6) << n;
  }
}

// Equal lamps along a street.
TEST(ManyLights, NearLampsOfAStreetAreChosen) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, test::scale(600, 10, 1), builder.diffuse(.5));
  const BsdfIndex black = builder.diffuse(0);
  const TextureIndex radiance = builder.texture({5, 5, 5});
  for (int i = 0; i < 512; ++i)
    builder
        .shape(DiskShape{},
               translate({2. * (i / 2) - 256, i % 2 ? 4. : -4., 3}) * test::rotate_x(180) * test::scale(.2),
               black)
        .emitter = AreaEmitter{radiance};
  const double gain = variance_gain(LightBench(builder), {{0, 0, 0}, {31, 2, 0}, {-255, -1, 0}});
  RecordProperty("street", std::to_string(gain));
  EXPECT_GT(gain, 20);
}

TEST(ManyLights, FewLightsUseTheTable) {
  const LightBench few(hall(20)), many(hall(60));
  EXPECT_FALSE(few.world->lights.has_tree());
  EXPECT_TRUE(many.world->lights.has_tree());
  RandomStream r(9);
  for (int i = 0; i < 100; ++i) {
    const LightNumbers u = numbers(r.uniform(), .5f, .5f);
    const LightChoice a = few.world->lights.choose(u), b = few.world->lights.choose(u, {V3(.1f), {0, 0, 1}});
    EXPECT_EQ(a.light, b.light);
    EXPECT_EQ(a.probability, b.probability);
  }
}

// Renders an image, in which directions that the floor samples hit some of the lights.
TEST(ManyLights, LightAFloorLikeTheSumOfSingleLights) {
  SceneBuilder builder = hall(60);
  builder.look({0, -3, 4}, {0, 0, 0}, 20);
  const auto all = test::estimate(builder, 256);
  SceneBuilder groups[2] = {hall(60), hall(60)};
  for (int g = 0; g < 2; ++g) {
    SceneBuilder& k = groups[g];
    k.look({0, -3, 4}, {0, 0, 0}, 20);
    // Each image has half of the lights, too few for a tree.
    std::size_t i = 0;
    for (Shape& s : k.scene.shapes)
      if (s.emitter && static_cast<int>(i++ % 2) != g) s.emitter.reset();
    std::erase_if(k.scene.emitters, [&](const Emitter&) { return static_cast<int>(i++ % 2) != g; });
  }
  const auto a = test::estimate(groups[0], 512), b = test::estimate(groups[1], 512);
  ASSERT_FALSE(LightBench(groups[0]).world->lights.has_tree() ||
               LightBench(groups[1]).world->lights.has_tree());
  const double slack = 5 * std::hypot(all.standard_error[0], a.standard_error[0], b.standard_error[0]);
  EXPECT_NEAR(all.mean[0], a.mean[0] + b.mean[0], slack);
  EXPECT_LT(all.standard_error[0], .01 * all.mean[0]);
}

}  // namespace
}  // namespace ls::render
