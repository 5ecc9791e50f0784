// Tests grids with a density per channel: the trackers against exact integrals, scattering, emission, and
// files with three equal channels, which are grey.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "tests/unit/render/grids.h"
#include "worker/render/media/emission.h"
#include "worker/render/media/optical_depth.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// The means are within 5 standard errors (each of 105 checks fails by chance with probability 6e-7, any of
// them with 6e-5)
constexpr int kFlights = 40000;
const Size kChannelsSize{9, 9, 9};
const V3 kFrom(-1, .3f, 1.1f), kAlong = normalize(V3(9, 7.1f, 6.2f));

struct Coloured {
  const char* name;
  std::vector<Grid> grids;  // those of the channels, then their mean
  float sigma;

  Medium medium() const {
    Medium m;
    m.grid = true;
    m.by_channel = {&grids[0], &grids[1], &grids[2]};
    m.density = &grids[3];
    m.sigma_t = C3(sigma);
    m.sigma_s = m.sigma_t * C3(.9f, .5f, 1);
    return m;
  }
  double depth(int c, double t) const {
    return sigma * exact_integral(grids[static_cast<std::size_t>(c)], V3d(kFrom), V3d(kAlong), 0, t);
  }
};

template <class Make>
Coloured coloured(const char* name, float sigma, Make make) {
  Coloured c{name, {}, sigma};
  for (int k = 0; k < 3; ++k) c.grids.push_back(make(k));
  for (Grid& g : c.grids) g.use_cells(4);
  c.grids.push_back(Grid::mean(c.grids[0], c.grids[1], c.grids[2]));
  return c;
}
std::vector<float> scaled(std::vector<float> v, float by) {
  for (float& x : v) x *= by;
  return v;
}

std::vector<Coloured> media() {
  std::vector<Coloured> all;
  const auto values = [](int c, bool sparse = false) {
    return random_values(kChannelsSize, static_cast<unsigned>(21 + c), sparse);
  };
  all.push_back(coloured("dense", .3f, [&](int c) { return unit_grid(kChannelsSize, values(c)); }));
  all.push_back(coloured("sparse, where others are not", 1.5f,
                         [&](int c) { return unit_grid(kChannelsSize, values(c, true)); }));
  // The first channel has no extinction. In the others some cells are tracked and some integrated exactly.
  all.push_back(coloured("apart", .6f, [&](int c) {
    return unit_grid(kChannelsSize, scaled(values(c, c == 2), c == 0 ? 0.f : c == 1 ? .5f : 20.f));
  }));
  all.push_back(coloured("nearest", .3f,
                         [&](int c) { return voxel_grid(kChannelsSize, values(c), kNearest, Wrap::clamp); }));
  all.push_back(coloured("repeated", .3f, [&](int c) {
    return voxel_grid(kChannelsSize, values(c), kTrilinear, Wrap::repeat);
  }));
  return all;
}

struct Sums {
  double sum[3] = {}, square[3] = {};
  void add(int c, double v) {
    sum[c] += v;
    square[c] += v * v;
  }
  void expect(int c, double expected, const std::string& what, double slack = 0) const {
    const double mean = sum[c] / kFlights,
                 se = std::sqrt(std::max(0., square[c] / kFlights - mean * mean) / kFlights);
    // Optical depths are sums of about 30 steps in float32, each rounded by 2^-24 of the depth.
    EXPECT_NEAR(mean, expected, 5 * se + expected * (30 * 0x1p-23 + slack)) << what << " channel " << c;
    EXPECT_LT(se, .1 * expected + 1e-6) << what << " channel " << c;
  }
};

TEST(Channels, TransmittancesAverageToEachChannelsOwn) {
  for (const Coloured& m : media()) {
    const Medium medium = m.medium();
    Sums ratio, flights;
    MediumCounters counters;
    for (int i = 0; i < kFlights; ++i) {
      const C3 r = transmittance<kEverything>(medium, kFrom, kAlong, 0, 30, RandomStream(mix64(i)));
      RandomStream s(mix64(i + (1ull << 40)));
      const std::uint32_t bits = s.bits();
      const Flight f = free_flight<kEverything>(medium, i % 3, bits, kFrom, kAlong, 30, s, counters);
      const double density = (double{f.density.x} + f.density.y + f.density.z) / 3;
      for (int c = 0; c < 3; ++c) {
        ratio.add(c, r[c]);
        flights.add(c, f.scattered ? 0 : f.weight[c] / density);
      }
    }
    EXPECT_EQ(counters.majorant_violations, 0u);
    for (int c = 0; c < 3; ++c) {
      ratio.expect(c, std::exp(-m.depth(c, 30)), std::string(m.name) + " ratio");
      flights.expect(c, std::exp(-m.depth(c, 30)), std::string(m.name) + " flights");
    }
  }
}

// Light scattered within each third of the ray: the albedo times the light that is lost there.
TEST(Channels, FlightsScatterAccordingToEachChannelsExtinction) {
  for (const Coloured& m : media()) {
    const Medium medium = m.medium();
    Sums scattered[3];
    MediumCounters counters;
    const double ends[4] = {0, 5, 9, 30};
    for (int i = 0; i < kFlights; ++i) {
      RandomStream s(mix64(i + (1ull << 41)));
      const std::uint32_t bits = s.bits();
      const Flight f = free_flight<kEverything>(medium, i % 3, bits, kFrom, kAlong, 30, s, counters);
      const double density = (double{f.density.x} + f.density.y + f.density.z) / 3;
      for (int part = 0; part < 3; ++part) {
        const bool here = f.scattered && f.t >= ends[part] && f.t < ends[part + 1];
        for (int c = 0; c < 3; ++c) scattered[part].add(c, here ? f.weight[c] / density : 0);
      }
    }
    for (int part = 0; part < 3; ++part)
      for (int c = 0; c < 3; ++c) {
        const double lost = std::exp(-m.depth(c, ends[part])) - std::exp(-m.depth(c, ends[part + 1]));
        const double albedo = medium.sigma_s[c] / medium.sigma_t[c];
        scattered[part].expect(c, albedo * lost, fmt::format("{} part {}", m.name, part));
      }
  }
}

TEST(Channels, TransmittanceIsExactForEveryHeroChannel) {
  for (const Coloured& m : media())
    for (const int hero : {0, 1, 2}) {
      const Flight f = passed(m.medium(), hero, kFrom, kAlong, 8);
      for (int c = 0; c < 3; ++c) {
        const double expected = std::exp(m.depth(hero, 8) - m.depth(c, 8));
        // Rounding positions to float32 shifts the ends of 30 steps by 2^-19 voxels.
        EXPECT_NEAR(f.weight[c] / expected, 1, m.sigma * 20 * 30 * 0x1p-19) << m.name;
        EXPECT_EQ(f.weight[c], f.density[c]);
      }
    }
}

// The weights by which channels are combined are never larger than the number of channels.
TEST(Channels, NoWeightIsAboveThree) {
  for (const Coloured& m : media()) {
    MediumCounters counters;
    for (int i = 0; i < 3000; ++i) {
      RandomStream s(mix64(i));
      const std::uint32_t bits = s.bits();
      const Flight f = free_flight<kEverything>(m.medium(), i % 3, bits, kFrom, kAlong, 30, s, counters);
      const float mean = (f.density.x + f.density.y + f.density.z) / 3;
      ASSERT_TRUE(is_finite(f.weight) && is_finite(f.density)) << m.name;
      for (int c = 0; c < 3; ++c) ASSERT_LE(f.weight[c] / mean, 3 * (1 + 0x1p-20)) << m.name;
    }
  }
}

// With a constant source radiance, each channel emits that radiance times 1 - transmittance.
TEST(Channels, EmissionIsPerChannel) {
  for (const Coloured& m : media()) {
    Medium medium = m.medium();
    medium.sigma_s = C3(0);
    medium.emission_kind = EmissionKind::per_absorption;
    medium.emission = C3(1, 2.5f, .25f);
    const C3 light = emission_of_grid(medium, kFrom, kAlong, 30, RandomStream(7));
    for (int c = 0; c < 3; ++c) {
      const double expected = medium.emission[c] * -std::expm1(-m.depth(c, 30));
      EXPECT_NEAR(light[c], expected, 2e-5 * expected) << m.name << " " << c;
    }
  }
}

TEST(Channels, PointsAreProposedWhereverAnyChannelIsDense) {
  for (const Coloured& m : media()) {
    const Medium medium = m.medium();
    const OpticalDepth depths(medium, kFrom, kAlong, 30);
    for (double t = 0; t < 15; t += .01) {
      const OpticalDepth::Point at_point = depths.at(static_cast<float>(t));
      const V3 p = kFrom + kAlong * static_cast<float>(t);
      float most = 0;
      for (int c = 0; c < 3; ++c) {
        const Grid& g = m.grids[static_cast<std::size_t>(c)];
        const V3 q = g.to_index(p);
        bool inside = true;
        for (int k = 0; k < 3; ++k) inside = inside && q[k] >= g.domain_lo()[k] && q[k] <= g.domain_hi()[k];
        if (inside) most = std::max(most, g.value_anywhere(q));
      }
      if (most > 1e-3f) {
        ASSERT_GT(at_point.rate, 0) << m.name << " " << t;
      }
      const C3 scattering = depths.scattering(at_point, p);
      if (!(at_point.rate > 0 && most > 0)) continue;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(scattering[c], medium.sigma_s[c] * value_at(m.grids[static_cast<std::size_t>(c)], p),
                    medium.sigma_s[c] * 20 * 0x1p-15)
            << m.name;
    }
  }
}

using test::SceneBuilder;
using test::translate;
using test::operator*;

SceneBuilder lit_box(const std::vector<float>& values, int channels) {
  SceneBuilder builder({12, 8});
  const VolumeIndex v = builder.grid({4, 3, 5}, values, translate({-1, -1, -1}) * test::scale(2), channels);
  builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(v, {.9, .6, .9}, 1.5, .4));
  builder.scene.emitters.push_back(PointEmitter{{1.2, -1, 1.3}, {1, 1, 1}});
  builder.environment(.1);
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  return builder;
}
TileResult render(const SceneBuilder& builder) {
  return render_tile(*test::world_of(builder), {0, 0, 12, 8}, {0, 16}, nullptr, nullptr);
}

TEST(Channels, ThreeEqualOnesAreAGreyGridToTheLastBit) {
  std::vector<float> one(60), three;
  for (std::size_t i = 0; i < one.size(); ++i) {
    one[i] = static_cast<float>(i % 7) / 3;
    three.insert(three.end(), 3, one[i]);
  }

  const auto world = test::world_of(lit_box(three, 3));

  EXPECT_FALSE(world->need.chromatic);
  EXPECT_EQ(render(lit_box(three, 3)).sums, render(lit_box(one, 1)).sums);
  three.back() *= 1.5f;
  EXPECT_TRUE(test::world_of(lit_box(three, 3))->need.chromatic);
  EXPECT_NE(render(lit_box(three, 3)).sums, render(lit_box(one, 1)).sums);
}

// A file whose three channels are multiples of one grid gives the same light as a colour times that grid.
// Light that is scattered once differs only by noise; light that involves no random numbers is equal.
TEST(Channels, ThreeChannelFileIsReadInOrder) {
  std::vector<float> three;
  for (int i = 0; i < 60; ++i)
    for (const float c : {0.f, .5f, 2.f}) three.push_back(c);
  SceneBuilder builder = lit_box(three, 3);
  builder.scene.emitters.clear();
  builder.environment();
  auto& medium = std::get<HeterogeneousMedium>(builder.scene.media[0]);
  medium.albedo = builder.constant({0, 0, 0});
  builder.look({-5, 0, 0}, {0, 0, 0}, 1e-3);

  const test::Estimate e = test::estimate(builder, 64);

  for (std::size_t c = 0; c < 3; ++c) {
    const double expected = std::exp(-1.5 * 2 * std::array{0., .5, 2.}[c]);
    EXPECT_NEAR(e.mean[c], expected, 5 * e.standard_error[c] + 1e-5) << c;
  }
  EXPECT_LT(e.standard_error[1], .01);
}

// The same with one channel and a tint. The medium only absorbs, and the only light is the environment.
TEST(Channels, TintIsAFactorPerChannel) {
  const std::vector<float> one(60, 1);
  SceneBuilder builder = lit_box(one, 1);
  builder.scene.emitters.clear();
  builder.environment();
  auto& medium = std::get<HeterogeneousMedium>(builder.scene.media[0]);
  medium.albedo = builder.constant({0, 0, 0});
  medium.tint = {0, .5, 2};
  builder.look({-5, 0, 0}, {0, 0, 0}, 1e-3);

  EXPECT_TRUE(test::world_of(builder)->need.chromatic);
  const test::Estimate e = test::estimate(builder, 64);

  for (std::size_t c = 0; c < 3; ++c) {
    const double expected = std::exp(-1.5 * 2 * medium.tint[c]);
    EXPECT_NEAR(e.mean[c], expected, 5 * e.standard_error[c] + 1e-5) << c;
  }
}

TEST(Channels, TintOfAThreeChannelDensityIsRefused) {
  std::vector<float> three;
  for (int i = 0; i < 180; ++i) three.push_back(static_cast<float>(i % 5));
  SceneBuilder builder = lit_box(three, 3);
  auto& medium = std::get<HeterogeneousMedium>(builder.scene.media[0]);
  medium.tint = {.5, .5, .5};
  EXPECT_TRUE(build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1));
  medium.tint = {.5, 1, .5};

  const auto world = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);

  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("leave out 'tint'"), std::string::npos) << world.error().message;
}

}  // namespace
}  // namespace ls::render
