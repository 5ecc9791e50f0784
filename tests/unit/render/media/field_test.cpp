// Fields: the values and the bounds of products, maps and their parts, their macro cells, and integrals.
#include "worker/render/media/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/scene_builder.h"
#include "worker/render/media/field_build.h"
#include "worker/render/media/grid_load.h"
#include "worker/render/media/medium.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

VolumeIndex put(SceneBuilder& b, const Volume& v) {
  return SceneBuilder::push<VolumeTag>(b.scene.volumes, v);
}

LoadedVolume loaded(const SceneBuilder& b, VolumeIndex v, double scale = 1) {
  auto volume = load_volume(b.scene.volumes.at(v.value), AssetLoader{b.scene, b.files}, V3d(0), scale, 1);
  EXPECT_TRUE(volume) << (volume ? "" : volume.error().message);
  return std::move(*volume);
}
float at(const LoadedVolume& v, const V3& p) {
  const Grid& g = v.channels[0];
  return g.value_anywhere(g.to_index(p));
}

// The volumes of the tests: each fills the cube [0, 1]^3 or a part of it.
struct Kind {
  const char* name;
  VolumeIndex (*make)(SceneBuilder&);
};
VolumeIndex noise(SceneBuilder& b) {
  NoiseVolume v;
  v.scale = 6;
  v.octaves = 5;
  v.low = -.6;
  v.high = 1.4;
  v.seed = 8;
  v.to_world = test::rotate_x(30);
  v.max = {1, .8, 1.5};
  return put(b, v);
}
VolumeIndex fog(SceneBuilder& b) {
  HeightFogVolume v;
  v.value = 1.7;
  v.height = .3;
  v.ground_point = {0, .2, 0};
  v.ground_normal = {.3, 2, -.1};
  return put(b, v);
}
VolumeIndex grid(SceneBuilder& b) {
  std::vector<float> values(6 * 5 * 4);
  std::mt19937 rng(4);
  for (float& x : values) x = rng() % 3 == 0 ? 0 : static_cast<float>(rng() % 1000) / 500;
  return b.grid({6, 5, 4}, values, Transform{});
}
VolumeIndex product(SceneBuilder& b) { return put(b, ProductVolume{fog(b), noise(b)}); }
VolumeIndex of_grid(SceneBuilder& b) { return put(b, ProductVolume{grid(b), noise(b)}); }
VolumeIndex grid_within(SceneBuilder& b) { return put(b, ProductVolume{noise(b), grid(b)}); }
VolumeIndex cloud(SceneBuilder& b) {
  CloudVolume v;
  v.wispiness = .02;
  v.frequency = 3;
  return put(b, v);
}
RemapVolume curve(VolumeIndex of) {
  RemapVolume r;
  r.volume = of;
  r.in_low = .1;
  r.in_high = .9;
  r.gamma = 1.7;
  r.positions = {.1, .3, .35, .8};
  r.values = {0, 2, .5, 1};
  r.out_low = .25;
  r.out_high = 3;
  return r;
}
VolumeIndex remap(SceneBuilder& b) { return put(b, curve(product(b))); }
constexpr Kind kKinds[] = {
    {"noise", noise}, {"product", product}, {"product of a grid", of_grid}, {"grid within", grid_within},
    {"cloud", cloud}, {"remap", remap}};

// A million points: no value is outside of the bounds of its macro cell, and the cells' bounds are of use.
TEST(Field, MacroCellsBoundAllValues) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.name);
    SceneBuilder b;
    const LoadedVolume v = loaded(b, kind.make(b));
    const Grid& g = v.channels[0];
    ASSERT_EQ(g.lookup(), Lookup::field);
    std::mt19937_64 rng(1);
    std::uniform_real_distribution<float> unit(0, 1);
    double sum = 0, bound = 0;
    constexpr int kPoints = 200'000;
    for (int i = 0; i < kPoints; ++i) {
      V3 p;
      int cell[3];
      for (int k = 0; k < 3; ++k) {
        p[k] = g.domain_lo()[k] + unit(rng) * (g.domain_hi()[k] - g.domain_lo()[k]);
        cell[k] = std::min(static_cast<int>((p[k] - g.domain_lo()[k]) / static_cast<float>(g.cell_size())),
                           g.cells()[static_cast<std::size_t>(k)] - 1);
      }
      const float value = g.value<Lookup::field>(p);
      const MacroCell& c = g.cell(cell[0], cell[1], cell[2]);
      ASSERT_LE(value, c.hi);
      ASSERT_LE(std::abs(value - c.control), c.residual);
      ASSERT_GE(value, 0);
      sum += value;
      bound += c.hi;
    }
    EXPECT_GT(sum, 0);
    // Trackers find collisions at the rate of the bound, of which this share is real.
    EXPECT_GT(sum / bound, .05);
  }
}

TEST(Field, ProductsMultiplyAndMapsMap) {
  SceneBuilder b;
  const VolumeIndex n = noise(b), g = grid(b);
  const LoadedVolume of_noise = loaded(b, n), of_grid = loaded(b, g),
                     both = loaded(b, put(b, ProductVolume{n, g})), mapped = loaded(b, put(b, curve(n)));
  const HeightFogVolume& f = std::get<HeightFogVolume>(b.scene.volumes[fog(b).value]);
  const LoadedVolume fogged = loaded(b, put(b, ProductVolume{fog(b), n}));
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<float> unit(0, 1);
  int outside = 0;
  for (int i = 0; i < 5000; ++i) {
    const V3 p(unit(rng) * 1.2f - .1f, unit(rng), unit(rng));
    const bool inside = of_grid.channels[0].in_domain(of_grid.channels[0].to_index(p));
    outside += !inside;
    const float x = at(of_noise, p), y = inside ? at(of_grid, p) : 0;
    // Places are rounded to float32 in the index coordinates of each grid, which changes the noise by less
    // than 1e-4: up to 256 voxels, 6 * 2^4 cells of its last octave, and a slope of 7 at the strength 1/2
    // each.
    EXPECT_NEAR(at(both, p), x * y, 2e-4 * 2);
    double t = std::pow(std::clamp((x - .1) / .8, 0., 1.), 1.7);
    const double curved = t < .1    ? 0
                          : t < .3  ? (t - .1) * 10
                          : t < .35 ? 2 - (t - .3) * 30
                          : t < .8  ? .5 + (t - .35) / .9
                                    : 1;
    EXPECT_NEAR(at(mapped, p), .25 + 2.75 * curved, 2e-4 * 2.75 * 30 * 2);
    const V3d up = V3d(.3, 2, -.1).normalized();
    const double height = up.dot(V3d(p) - V3d(0, .2, 0));
    EXPECT_NEAR(at(fogged, p), x * f.value * std::exp(-std::max(0., height / f.height)), 2e-4 * 2);
  }
  EXPECT_GT(outside, 100);
}

TEST(Field, IsTheSameInAWorldOfAnySize) {
  SceneBuilder b;
  const VolumeIndex r = remap(b);
  const LoadedVolume small = loaded(b, r, 1. / 1024), large = loaded(b, r);
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const V3 p(unit(rng), unit(rng), unit(rng));
    EXPECT_EQ(at(small, p / 1024), at(large, p));
  }
}

// The mean of `g` between two points in index space, by the midpoint rule.
double mean_value(const Grid& g, const V3& from, const V3& to, int steps = 400'000) {
  const V3d o(from), d = V3d(to) - o;
  double sum = 0;
  for (int s = 0; s < steps; ++s) sum += g.value<Lookup::field>(V3(o + d * ((s + .5) / steps)));
  return sum / steps;
}

// Along any ray the integral is that of a fine midpoint rule, whose error is h^2 / 24 times the change of the
// slope, here at most 1e-5 of the largest value; and where it reaches a part of itself, the integral up to
// there is that part.
TEST(Field, IsIntegratedAlongRays) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.name);
    SceneBuilder b;
    const LoadedVolume v = loaded(b, kind.make(b));
    const Grid& g = v.channels[0];
    std::mt19937_64 rng(6);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int i = 0; i < 20; ++i) {
      V3 o, d;
      for (int k = 0; k < 3; ++k) {
        o[k] = g.domain_lo()[k] + unit(rng) * (g.domain_hi()[k] - g.domain_lo()[k]);
        d[k] = (unit(rng) - .5f) * 8;
      }
      const double mean = mean_value(g, o, o + d, 20000);
      const Passage whole = g.pass(o, d, 0, 1);
      EXPECT_FALSE(whole.reached);
      EXPECT_NEAR(whole.integral, mean, 2e-5 * g.max_value());
      if (!(mean > 1e-3)) continue;
      const Passage part = g.pass(o, d, 0, 1, .3 * whole.integral);
      ASSERT_TRUE(part.reached);
      EXPECT_NEAR(g.pass(o, d, 0, part.t).integral, .3 * whole.integral, 2e-5 * g.max_value());
    }
  }
}

// Noise that is 0 in most places, and whose bounds do not know it: each sample of the transmittance is from 0
// to 1, and their mean is that of the integral.
constexpr Features kFieldFeatures{.media = true, .grids = true};

TEST(Field, LetsLightThroughItsGaps) {
  NoiseVolume n;
  n.scale = 9;
  n.octaves = 3;
  n.low = -1.5;
  n.high = 1;
  SceneBuilder b;
  const LoadedVolume v = loaded(b, put(b, n));
  const Grid& g = v.channels[0];
  for (const float sigma : {20.f, 200.f}) {
    Medium m;
    m.grid = true;
    m.density = &g;
    m.sigma_t = C3(sigma);
    const V3 o(0, .3f, .4f), d(1, 0, 0);
    const double depth = sigma * mean_value(g, g.to_index(o), g.to_index(o + d));
    constexpr int kTries = 20000;
    double sum = 0, squares = 0;
    for (int i = 0; i < kTries; ++i) {
      const double t = transmittance<kFieldFeatures>(m, o, d, 0, 1, RandomStream(mix64(i))).x;
      ASSERT_GE(t, 0);
      ASSERT_LE(t, 1 + 1e-5);
      sum += t / kTries;
      squares += t * t / kTries;
    }
    const double error = std::sqrt((squares - sum * sum) / kTries);
    EXPECT_NEAR(sum, std::exp(-depth), 5 * error + 1e-6) << sigma;
    EXPECT_LT(error, .05 * std::exp(-depth) + 1e-4) << sigma;
  }
}

TEST(Field, FinerNoiseThanItsCellsIsIntegrated) {
  NoiseVolume n;
  n.scale = 400;
  n.octaves = 2;
  n.low = -4;
  n.high = 4;
  SceneBuilder b;
  const LoadedVolume v = loaded(b, put(b, n));
  const Grid& g = v.channels[0];
  const V3 from = g.to_index(V3(.01f, .3f, .4f)), to = g.to_index(V3(.99f, .35f, .45f));
  const double mean = mean_value(g, from, to);
  EXPECT_NEAR(g.pass(from, to - from, 0, 1).integral, mean, 1e-3 * mean);
}

TEST(Field, StoresNoValues) {
  SceneBuilder b;
  const LoadedVolume first = loaded(b, noise(b)), second = loaded(b, noise(b));
  const Grid &g = first.channels[0], &other = second.channels[0];
  EXPECT_EQ(g.count_above(0), 0u) << "as is asked of albedos";
  EXPECT_EQ(g.voxels().count(), 0u);
  EXPECT_TRUE(g.same_values(other));
}

TEST(Field, IsNeverNegative) {
  SceneBuilder b;
  RemapVolume r = curve(noise(b));
  r.out_low = 1;
  r.out_high = 0;
  r.values = {0, 2, .5, 1};
  const LoadedVolume v = loaded(b, put(b, r));
  const Grid& g = v.channels[0];
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<float> unit(0, 1);
  float least = 1, most = 0;
  for (int i = 0; i < 20000; ++i) {
    V3 p;
    for (int k = 0; k < 3; ++k) p[k] = g.domain_lo()[k] + unit(rng) * (g.domain_hi()[k] - g.domain_lo()[k]);
    least = std::min(least, g.value<Lookup::field>(p));
    most = std::max(most, g.value<Lookup::field>(p));
  }
  EXPECT_EQ(least, 0);
  EXPECT_GT(most, .5f);
}

}  // namespace
}  // namespace ls::render
