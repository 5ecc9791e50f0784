// Whole worlds: every variant, every power-of-two scale and every number of threads gives the same bits, and
// scenes that cannot be built are refused with a message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>
#include <limits>

#include "tests/support/render_check.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;
using testing::HasSubstr;

struct Named {
  const char* name;
  SceneBuilder builder;
  std::size_t variants;  // number of specialised variants that cover it
};

// A floor, objects, lights of several kinds, and space for a medium.
SceneBuilder room() {
  SceneBuilder builder({12, 8});
  const BsdfIndex white = builder.diffuse(.6);
  const BsdfIndex metal = builder.bsdf(RoughConductorBsdf{Microfacet::ggx,
                                                          builder.texture({.3, .3, .3}),
                                                          builder.texture({.3, .3, .3}),
                                                          {.2, .9, 1.1},
                                                          {3.9, 2.4, 2.2},
                                                          builder.texture({1, 1, 1})});
  const TextureIndex light = builder.texture({3, 2, 1});
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(3), white);
  builder.shape(SphereShape{}, translate({.6, .8, -.5}) * test::scale(.4), metal);
  builder.shape(SphereShape{}, translate({-.7, .9, -.6}) * test::scale(.3), builder.glass(1.5));
  builder.shape(RectangleShape{}, translate({0, 0, 2}) * test::rotate_x(180) * test::scale(.5), white)
      .emitter = AreaEmitter{light};
  builder.scene.emitters.push_back(PointEmitter{{1, -1, 1}, {1, 1, 1}});
  builder.scene.emitters.push_back(DirectionalEmitter{{.3, .2, -1}, {.5, .5, .5}});
  builder.environment(.1);
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  builder.scene.integrator.camera_points = -1;
  builder.scene.integrator.phase_only = true;
  return builder;
}
SceneBuilder aimed(SceneBuilder builder) {
  builder.scene.integrator.camera_points = 3;
  builder.scene.integrator.phase_only = false;
  return builder;
}
std::vector<float> cloud() {
  std::vector<float> v(6 * 5 * 4);
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = static_cast<float>((i * 7919) % 11) / 5.f;
  return v;
}
SceneBuilder with_medium(auto make) {
  SceneBuilder builder = room();
  const MediumIndex m = make(builder);
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, test::rotate_x(15) * test::scale(.9), null, m);
  return builder;
}
const Transform kBox = translate({-1, -1, -1}) * test::scale(2);

// Adds panes and masks in front of everything, and around the medium if there is one.
SceneBuilder veiled(SceneBuilder builder) {
  const TextureIndex white = builder.texture({1, 1, 1}), tint = builder.texture({.9, .5, .7}),
                     rough = builder.texture({.2, .2, .2});
  const BsdfIndex pane = builder.bsdf(ThinDielectricBsdf{1.5, 1, white, tint});
  const BsdfIndex glass =
      builder.bsdf(RoughDielectricBsdf{Microfacet::ggx, rough, rough, 1.5, 1, white, tint});
  const BsdfIndex grey = builder.diffuse(.5);
  const BsdfIndex mask =
      builder.bsdf(MaskBsdf{builder.texture({.3, .3, .3}), builder.bsdf(TwoSidedBsdf{grey, grey})});
  const BsdfIndex blend = builder.bsdf(BlendBsdf{builder.texture({.4, .4, .4}), mask, glass});
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * test::scale(2), mask);
  builder.shape(RectangleShape{}, translate({0, -2, 0}) * test::rotate_x(90) * test::scale(2), pane);
  builder.shape(SphereShape{}, translate({.2, -.9, -.6}) * test::scale(.3), blend);
  return builder;
}

HeightFogVolume falling_fog() {
  HeightFogVolume v;
  v.value = 1.5;
  v.height = .5;
  v.ground_point = {0, -.5, 0};
  v.ground_normal = {.1, 1, 0};
  return v;
}

std::vector<Named> scenes() {
  std::vector<Named> all;
  all.push_back({"surfaces", room(), 8});
  all.push_back({"homogeneous grey", with_medium([](SceneBuilder& k) {
                   return k.homogeneous({.8, .8, .8}, {.9, .5, .2}, .3);
                 }),
                 6});
  all.push_back({"homogeneous chromatic", with_medium([](SceneBuilder& k) {
                   return k.homogeneous({0, .8, 3}, {.9, .9, .9}, -.3);
                 }),
                 3});
  all.push_back({"grey grid", with_medium([](SceneBuilder& k) {
                   return k.heterogeneous(k.grid({6, 5, 4}, cloud(), kBox), {.9, .6, .9}, 1, .5);
                 }),
                 3});
  all.push_back({"grid of plain voxels", with_medium([](SceneBuilder& k) {
                   const VolumeIndex v = k.grid({6, 5, 4}, cloud(), kBox);
                   std::get<GridVolume>(k.scene.volumes[v.value]).filter = VolumeFilter::nearest;
                   return k.heterogeneous(v, {.9, .6, .9}, 1, .5);
                 }),
                 3});
  all.push_back({"repeated grid", with_medium([](SceneBuilder& k) {
                   const VolumeIndex v = k.grid({6, 5, 4}, cloud(), kBox);
                   std::get<GridVolume>(k.scene.volumes[v.value]).wrap = Wrap::repeat;
                   return k.heterogeneous(v, {.9, .6, .9}, 1, .5);
                 }),
                 3});
  all.push_back({"chromatic grid", with_medium([](SceneBuilder& k) {
                   return k.heterogeneous(k.constant({0, 1, 4}), {.9, .9, .9}, 1, .5);
                 }),
                 2});
  all.push_back({"grid of three channels", with_medium([](SceneBuilder& k) {
                   std::vector<float> three;
                   for (const float x : cloud()) three.insert(three.end(), {x, .3f, 2 - x / 2});
                   return k.heterogeneous(k.grid({6, 5, 4}, three, kBox, 3), {.9, .6, .9}, 1, .5);
                 }),
                 2});
  all.push_back({"veils", veiled(room()), 7});
  all.push_back({"veils and a chromatic medium", veiled(with_medium([](SceneBuilder& k) {
                   return k.homogeneous({0, .8, 3}, {.9, .9, .9}, -.3);
                 })),
                 3});
  all.push_back({"glowing homogeneous", with_medium([](SceneBuilder& k) {
                   const MediumIndex m = k.homogeneous({0, .8, 3}, {.9, .5, .9}, -.3);
                   std::get<HomogeneousMedium>(k.scene.media[m.value]).emission = {1, 0, 2};
                   return m;
                 }),
                 1});
  all.push_back({"glowing grid", with_medium([](SceneBuilder& k) {
                   const VolumeIndex v = k.grid({6, 5, 4}, cloud(), kBox);
                   const MediumIndex m = k.heterogeneous(v, {.9, .6, .9}, 1, .5);
                   auto& h = std::get<HeterogeneousMedium>(k.scene.media[m.value]);
                   h.temperature = v;
                   h.temperature_scale = 1000;
                   return m;
                 }),
                 1});
  all.push_back({"phase functions of colours", with_medium([](SceneBuilder& k) {
                   const MediumIndex m = k.homogeneous({0, .8, 3}, {.9, .5, .9});
                   const auto put = [&](const Phase& p) { return k.push<PhaseTag>(k.scene.phases, p); };
                   const PhaseIndex table = put(TabulatedPhase{{}, {1, 2}, {3, 1}, {1, 0}, {}, {}});
                   const PhaseIndex droplets = put(DropletsPhase{8});
                   const PhaseIndex blend = put(BlendPhase{k.constant({.4, .4, .4}), droplets, table});
                   std::get<HomogeneousMedium>(k.scene.media[m.value]).phase = blend;
                   return m;
                 }),
                 0});
  all.push_back(
      {"fog that falls with height", with_medium([](SceneBuilder& k) {
         return k.heterogeneous(k.push<VolumeTag>(k.scene.volumes, falling_fog()), {.9, .6, .9}, 1, .5);
       }),
       0});
  all.push_back(
      {"noise in a cloud, mapped", with_medium([](SceneBuilder& k) {
         const auto put = [&](const Volume& v) { return k.push<VolumeTag>(k.scene.volumes, v); };
         NoiseVolume noise;
         noise.scale = 3;
         noise.to_world = kBox;
         const VolumeIndex product = put(ProductVolume{put(noise), k.grid({6, 5, 4}, cloud(), kBox)});
         const VolumeIndex falling = put(ProductVolume{product, put(falling_fog())});
         return k.heterogeneous(put(RemapVolume{falling, 0, 2, 1.5, {}, {}, 0, 3}), {.9, .6, .9}, 1, .5);
       }),
       3});
  return all;
}

TileResult render(const World& w, const char* variant = nullptr) {
  const PixelRect all{0, 0, 12, 8};
  return variant ? render_tile_as(w, variant, all, {0, 32}) : render_tile(w, all, {0, 32}, nullptr, nullptr);
}

TEST(World, EveryVariantThatCoversASceneGivesTheSameBits) {
  for (const Named& n : scenes()) {
    const auto world = test::world_of(n.builder);
    const auto names = covering_variants(*world);
    const TileResult first = render(*world);
    // Three more variants are the one for all phase functions, the one for fog that falls with height and the
    // one for AOVs of light; for fog that falls with height there is one of its own in place of the first.
    // Those for surfaces that move are not counted.
    const auto of_still_scenes = std::ranges::count_if(
        names, [](const std::string& name) { return name.find("that move") == name.npos; });
    EXPECT_EQ(static_cast<std::size_t>(of_still_scenes), n.variants + 3) << n.name;
    EXPECT_EQ(names.front(), describe(*world).variant);
    EXPECT_EQ(first.health.nonfinite + first.health.negative + first.health.majorant_violations, 0u)
        << n.name;
    for (const std::string& name : names) {
      EXPECT_EQ(render(*world, name.c_str()).sums, first.sums) << n.name << " as " << name;
    }
  }
}

TEST(World, AllVariantsSampleTheSkyTheSame) {
  const auto world = test::world_of(test::sky_yard({16, 16}));
  ASSERT_TRUE(world->sky_samples);
  const auto names = covering_variants(*world);
  EXPECT_GE(names.size(), 3u);
  const TileResult first = render(*world);
  for (const std::string& name : names) EXPECT_EQ(render(*world, name.c_str()).sums, first.sums) << name;
}

TEST(World, EveryVariantThatAimsGivesTheSameBits) {
  int found = 0;
  for (const Named& n : scenes()) {
    const auto world = test::world_of(aimed(n.builder));
    const auto names = covering_variants(*world);
    if (names.front().find("aimed") == std::string::npos) continue;
    ++found;
    const TileResult first = render(*world);
    EXPECT_NE(first.sums, render(*test::world_of(n.builder)).sums) << n.name;
    EXPECT_EQ(first.health.nonfinite + first.health.negative + first.health.majorant_violations, 0u)
        << n.name;
    EXPECT_GE(names.size(), 2u) << n.name;
    for (const std::string& name : names)
      EXPECT_EQ(render(*world, name.c_str()).sums, first.sums) << n.name << " as " << name;
  }
  EXPECT_GE(found, 8);
}

TEST(World, PartOfATileEqualsThatPart) {
  const auto world = test::world_of(room());
  const TileResult all = render(*world), part = render_tile(*world, {3, 2, 7, 5}, {0, 32}, nullptr, nullptr);
  for (std::size_t plane = 0; plane < 6; ++plane)
    for (std::size_t y = 2; y < 5; ++y)
      for (std::size_t x = 3; x < 7; ++x)
        ASSERT_EQ(part.sums[plane * 12 + (y - 2) * 4 + x - 3], all.sums[plane * 96 + y * 12 + x]);
}

TEST(World, GroupingOfRoundsDoesNotChangeTheSampleSequence) {
  const auto world = test::world_of(room());
  const PixelRect all{0, 0, 12, 8};
  const auto sums = [&](SampleRange r) { return render_tile(*world, all, r, nullptr, nullptr).sums; };
  const auto whole = sums({0, 16}), first = sums({0, 4}), second = sums({4, 16});
  for (std::size_t i = 0; i < whole.size(); ++i) {
    // The error is that of three roundings of sums in double to float32.
    ASSERT_NEAR(whole[i], double{first[i]} + second[i], 3 * 0x1p-24 * whole[i]);
  }
}

TEST(World, PixelsDoNotDependOnBuildThreads) {
  for (const Named& n : scenes()) {
    EXPECT_EQ(render(*test::world_of(n.builder, 0, 1)).sums, render(*test::world_of(n.builder, 0, 2)).sums)
        << n.name;
  }
}

TEST(World, AnotherSeedGivesOtherSamples) {
  EXPECT_NE(render(*test::world_of(room(), 0)).sums, render(*test::world_of(room(), 1)).sums);
}

TEST(World, SamplesOfARangeMatchTheirReplay) {
  const auto world = test::world_of(room());
  const TileResult r = render_tile(*world, {5, 3, 6, 4}, {0, 8}, nullptr, nullptr);
  double even[3] = {}, odd[3] = {};
  for (std::uint64_t s = 0; s < 8; ++s) {
    const SampleValue v = render_sample(*world, 5, 3, s);
    for (int c = 0; c < 3; ++c) (s % 2 ? odd : even)[c] += v.rgb[c];
  }
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(r.sums[c], static_cast<float>(even[c]));
    EXPECT_EQ(r.sums[3 + c], static_cast<float>(odd[c]));
  }
}

// The scene enlarged by 2^k, with thinner media and brighter lights, so that the image is the same.
SceneBuilder scaled(SceneBuilder builder, int k) {
  const double f = std::ldexp(1., k);
  const auto move = [&](Transform& t) { t = test::scale(f) * t; };
  for (Shape& s : builder.scene.shapes) move(s.to_world);
  for (Emitter& e : builder.scene.emitters) {
    if (auto* p = std::get_if<PointEmitter>(&e)) {
      for (double& x : p->position) x *= f;
      for (double& x : p->intensity) x *= f * f;
    }
  }
  for (ls::Medium& m : builder.scene.media) {
    std::visit(
        [&](auto& v) {
          if constexpr (requires { v.scale; }) v.scale /= f;
        },
        m);
    if (auto* h = std::get_if<HomogeneousMedium>(&m))
      for (double& e : h->emission) e /= f;
  }
  for (Volume& volume : builder.scene.volumes)
    std::visit(
        [&](auto& v) {
          if constexpr (requires { v.to_world; }) move(v.to_world);
        },
        volume);
  for (int row = 0; row < 3; ++row)
    builder.scene.sensor.to_world.m[static_cast<std::size_t>(4 * row + 3)] *= f;
  builder.scene.sensor.near_clip *= f;
  builder.scene.sensor.far_clip *= f;
  builder.scene.sensor.focus_distance *= f;
  builder.scene.sensor.aperture_radius *= f;
  return builder;
}

TEST(World, ScalingByAPowerOfTwoChangesNoBit) {
  for (const Named& n : scenes()) {
    const auto reference = render(*test::world_of(n.builder)).sums;
    for (int k = -13; k <= 13; ++k) {
      ASSERT_EQ(render(*test::world_of(scaled(n.builder, k))).sums, reference) << n.name << " times 2^" << k;
    }
  }
}

TEST(World, ThinLensScalesWithTheScene) {
  SceneBuilder builder = room();
  builder.scene.sensor.aperture_radius = .2;
  builder.scene.sensor.focus_distance = 5;
  const auto reference = render(*test::world_of(builder)).sums;
  for (const int k : {-13, -1, 1, 13})
    EXPECT_EQ(render(*test::world_of(scaled(builder, k))).sums, reference) << k;
}

// Scenes that cannot be built

std::string error_of(const SceneBuilder& builder) {
  const auto w = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  return w ? "" : w.error().message;
}

TEST(World, RefusesReferencesToMissingObjects) {
  SceneBuilder builder = room();
  builder.scene.shapes[0].bsdf = {99};
  EXPECT_THAT(error_of(builder), HasSubstr("does not have"));
  builder = room();
  builder.scene.shapes[0].interior = MediumIndex{5};
  EXPECT_THAT(error_of(builder), HasSubstr("does not have"));
  builder = room();
  builder.scene.sensor.medium = MediumIndex{0};
  EXPECT_THAT(error_of(builder), HasSubstr("does not have"));
  builder = room();
  builder.scene.shapes[3].emitter->radiance = {77};
  EXPECT_THAT(error_of(builder), HasSubstr("does not have"));
}

TEST(World, RefusesShapesWithoutAnInverseOrBeyondAllBounds) {
  SceneBuilder builder = room();
  builder.scene.shapes[1].to_world = test::scale(1, 0, 1);
  EXPECT_THAT(error_of(builder), HasSubstr("shape 2: its to_world has no inverse"));
  builder = room();
  builder.scene.shapes[0].to_world.m[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of(builder), HasSubstr("shape 1"));
  builder = room();
  builder.scene.shapes[1].to_world = test::scale(1, 2, 1);
  EXPECT_THAT(error_of(builder), HasSubstr("uniformly"));
}

TEST(World, RefusesGridsWithNonFiniteValuesOrASingularTransform) {
  const auto with_grid = [](float value, const Transform& t) {
    return with_medium([&](SceneBuilder& k) {
      return k.heterogeneous(k.grid({2, 2, 2}, std::vector<float>(8, value), t), {1, 1, 1});
    });
  };
  EXPECT_THAT(error_of(with_grid(std::nanf(""), kBox)), HasSubstr("grid.vol"));
  EXPECT_THAT(error_of(with_grid(std::numeric_limits<float>::infinity(), kBox)), HasSubstr("grid.vol"));
  EXPECT_THAT(error_of(with_grid(1, test::scale(0))), HasSubstr("inverted"));
  // Finite maps with a determinant that is not finite, or without a finite inverse.
  EXPECT_THAT(error_of(with_grid(1, test::scale(1e200))), HasSubstr("inverted"));
  EXPECT_THAT(error_of(with_grid(1, test::scale(1e-105))), HasSubstr("inverted"));
  EXPECT_EQ(error_of(with_grid(1, kBox)), "");
}

TEST(World, RefusesPhaseFunctionsThatRoundToForwardOrBackwardOnly) {
  const auto with_g = [](double g) {
    return with_medium([&](SceneBuilder& k) { return k.homogeneous({1, 1, 1}, {1, 1, 1}, g); });
  };
  EXPECT_THAT(error_of(with_g(.99999999)), HasSubstr("g = 0.99999999"));
  EXPECT_THAT(error_of(with_g(-.99999999)), HasSubstr("g = -0.99999999"));
  EXPECT_EQ(error_of(with_g(.9999)), "");
  EXPECT_EQ(error_of(with_g(1 - 0x1p-24)), "");
}

TEST(World, RefusesExtinctionsBeyondFloat32) {
  EXPECT_THAT(error_of(with_medium([](SceneBuilder& k) {
                return k.homogeneous({1e31, 1, 1}, {1, 1, 1});
              })),
              HasSubstr("extinction reaches 1e+31 per scene unit"));
  const auto with_density = [](float density, double scale) {
    return with_medium([&](SceneBuilder& k) {
      return k.heterogeneous(k.grid({2, 2, 2}, std::vector<float>(8, density), kBox), {1, 1, 1}, scale);
    });
  };
  EXPECT_THAT(error_of(with_density(1e38f, 1)), HasSubstr("extinction"));
  EXPECT_THAT(error_of(with_density(1e20f, 1e20)), HasSubstr("extinction"));
  EXPECT_EQ(error_of(with_density(1e10f, 1e10)), "");
}

TEST(World, RefusesBodiesOfPeakOneWhoseRadianceIsBeyondFloat32) {
  const auto with_kelvin = [](bool grid, double scale) {
    return with_medium([&](SceneBuilder& k) {
      const MediumIndex m = k.heterogeneous(k.constant({1, 1, 1}), {.5, .5, .5});
      auto& medium = std::get<HeterogeneousMedium>(k.scene.media[m.value]);
      medium.temperature =
          grid ? k.grid({2, 2, 2}, std::vector<float>(8, 1000), kBox) : k.constant({1000, 1000, 1000});
      medium.temperature_scale = scale;
      medium.peak_one = true;
      return m;
    });
  };
  for (const bool grid : {false, true}) {
    EXPECT_THAT(error_of(with_kelvin(grid, 1e28)), HasSubstr("a temperature above 1e30 K")) << grid;
    EXPECT_EQ(error_of(with_kelvin(grid, 1e26)), "") << grid;
  }
}

TEST(World, UnusedMediumIsNotLoaded) {
  SceneBuilder builder = room();
  builder.heterogeneous(builder.grid({2, 2, 2}, std::vector<float>(8, 1), kBox), {1, 1, 1});
  const auto bytes_of_grids = [](const SceneBuilder& k) {
    std::uint64_t bytes = 0;
    for (const auto& s : describe(*test::world_of(k)).structures)
      bytes += s.name == "grid values" || s.name == "majorant cells" ? s.bytes : 0;
    return bytes;
  };
  EXPECT_EQ(bytes_of_grids(builder), 0u);
  builder.files.clear();
  EXPECT_EQ(error_of(builder), "");
  EXPECT_GT(bytes_of_grids(scenes()[3].builder), 0u);
}

TEST(World, NamesAMissingFile) {
  SceneBuilder builder = scenes()[3].builder;
  builder.files.clear();
  EXPECT_THAT(error_of(builder), HasSubstr("grid.vol"));
}

TEST(World, CountsNegativeDensitiesThatItMadeZero) {
  SceneBuilder builder = with_medium([](SceneBuilder& k) {
    return k.heterogeneous(k.grid({2, 1, 1}, {-1, 1}, kBox), {1, 1, 1});
  });
  EXPECT_EQ(describe(*test::world_of(builder)).clamped_inputs, 1u);
}

TEST(World, CountsAlbedosOfAGridThatAreAboveOne) {
  for (const Wrap wrap : {Wrap::clamp, Wrap::repeat}) {
    SceneBuilder builder = with_medium([&](SceneBuilder& k) {
      const VolumeIndex albedo = k.grid({4, 1, 1}, {1.5f, .5f, 1, 2}, kBox);
      std::get<GridVolume>(k.scene.volumes[albedo.value]).wrap = wrap;
      const MediumIndex m = k.heterogeneous(k.grid({2, 1, 1}, {2, 1}, kBox), {1, 1, 1});
      std::get<HeterogeneousMedium>(k.scene.media[m.value]).albedo = albedo;
      return m;
    });
    EXPECT_EQ(describe(*test::world_of(builder)).clamped_inputs, 2u);
  }
}

TEST(World, EmptySceneShowsItsSky) {
  SceneBuilder builder({2, 2});
  builder.environment(.25);
  const TileResult r = render_tile(*test::world_of(builder), {0, 0, 2, 2}, {0, 4}, nullptr, nullptr);
  for (const float s : r.sums) EXPECT_EQ(s, .5f);  // each half has two samples
}

// Light that media emit counts at the same depth as that of an emitter that the path hits.
TEST(World, EmissionOfMediaCountsAtItsDepth) {
  const auto mean = [](int max_depth, bool hidden, double floor) {
    SceneBuilder builder({4, 4});
    const MediumIndex m = builder.homogeneous({0, 0, 0}, {0, 0, 0});
    std::get<HomogeneousMedium>(builder.scene.media[m.value]).emission = {1, 2, 3};
    builder.container(CubeShape{}, translate({0, 0, 5}), builder.null(), m);
    builder.shape(RectangleShape{}, test::scale(100), builder.diffuse(floor));
    builder.scene.integrator.max_depth = max_depth;
    builder.scene.integrator.hide_emitters = hidden;
    builder.look({0, 0, 9}, {0, 0, 0}, 1e-3, {0, 1, 0});
    return test::estimate(builder, 64).mean;
  };
  // The ray crosses 2 units of the medium and ends at a black floor.
  const std::array<double, 3> through{2, 4, 6}, dark{0, 0, 0};
  EXPECT_EQ(mean(0, false, 0), dark);
  EXPECT_EQ(mean(1, false, 0), through);
  EXPECT_EQ(mean(1, true, 0), dark);
  // Light that a white floor scatters is one segment deeper, whether emitters are hidden or not.
  EXPECT_EQ(mean(1, false, 1), through);
  EXPECT_GT(mean(2, false, 1)[0], 2.001);
  EXPECT_GT(mean(2, true, 1)[0], .001);
}

}  // namespace
}  // namespace ls::render
