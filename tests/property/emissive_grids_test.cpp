// Looking for emissive grids by next-event estimation brings the same image as meeting their light by chance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "tests/property/quarters.h"
#include "tests/support/fire.h"
#include "tests/support/significance.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

TEST(EmissiveGrids, GiveTheSameImageAsPathsThatMeetTheirLight) {
  constexpr int kSeeds = 24;
  Tests tests("property/emissive_grids");
  struct Rival {
    const char* name;
    Fire fire;
    std::function<void(SceneBuilder&)> change = [](SceneBuilder&) {};
    const char* variant = "";  // what the name of the path tracer must contain
    std::uint64_t spp = 32;
  };
  const auto lamp = [](SceneBuilder& b) {
    b.scene.emitters.push_back(PointEmitter{{-1.5, 1.5, -1}, {2, 2, 2}});
  };
  const auto thin_glass = [](SceneBuilder& b) {
    const TextureIndex white = b.texture({1, 1, 1});
    b.shape(RectangleShape{}, translate({.6, .8, 0}) * rotate_y(90),
            b.bsdf(ThinDielectricBsdf{1.5, 1, white, white}));
  };
  const auto overlap = [](SceneBuilder& b) {
    const MediumIndex haze = b.homogeneous({.5, .6, .7}, {.8, .8, .8}, 0);
    b.set_emission(haze, {.05, .02, .01});
    b.container(SphereShape{}, translate({.2, .9, 0}) * scale(.7), b.null(), haze);
  };
  const auto unseen = [](SceneBuilder& b) {
    b.shape(SphereShape{}, translate({-1, .4, 0}) * scale(.4), b.diffuse(.5)).visible_reflection = false;
  };
  // The flame's density or its light as volumes that are computed: the grid's values, torn by noise.
  const auto torn = [](SceneBuilder& b, std::optional<VolumeIndex> HeterogeneousMedium::*light) {
    const auto push = [&](const Volume& v) { return SceneBuilder::push<VolumeTag>(b.scene.volumes, v); };
    auto& flame = std::get<HeterogeneousMedium>(b.scene.media.at(0));
    NoiseVolume noise;
    noise.scale = 4;
    noise.octaves = 3;
    noise.low = -.5;
    noise.high = 2;
    const VolumeIndex rips = push(noise);
    flame.sigma_t = push(ProductVolume{flame.sigma_t, rips});
    RemapVolume bent{push(ProductVolume{rips, *(flame.*light)})};
    bent.gamma = .7;
    bent.positions = {0, .3, 1};
    bent.values = {0, .8, 1};
    flame.*light = push(bent);
  };
  const auto torn_emission = [=](SceneBuilder& b) { torn(b, &HeterogeneousMedium::emission); };
  const auto torn_source = [=](SceneBuilder& b) { torn(b, &HeterogeneousMedium::source_radiance); };
  // The fog around the flame as one that falls with height
  const auto falling_fog = [](SceneBuilder& b) {
    HeightFogVolume fog;
    fog.value = .4;
    fog.height = .6;
    b.scene.media.at(1) = std::get<HeterogeneousMedium>(
        b.scene
            .media[b.heterogeneous(SceneBuilder::push<VolumeTag>(b.scene.volumes, fog), {.9, .9, .9}).value]);
    b.scene.media.pop_back();
  };
  const Rival rivals[] = {{"fire", {}},
                          {"fire by absorption", {.absorbed = true}},
                          {"hot fire over a glossy floor", {.glossy = true, .black_body = true}, {}, "", 64},
                          {"fire in fog", {.fog = true}, {}, "", 96},
                          {"coloured fire in coloured fog", {.fog = true, .coloured = true}, {}, "", 96},
                          {"fire in fog with a lamp", {.fog = true}, lamp, "aimed"},
                          {"fire behind thin glass", {}, thin_glass},
                          {"fire across haze that glows", {}, overlap},
                          {"fire and a ball that reflections do not show", {}, unseen},
                          {"fire torn by noise", {}, torn_emission},
                          {"fire by absorption torn by noise", {.absorbed = true}, torn_source, "", 64},
                          {"fire in fog that falls with height", {.fog = true}, falling_fog, "height", 96}};
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const Rival& rival : rivals) {
    const auto scene = [&](int emissive_grids) {
      Fire fire = rival.fire;
      fire.emissive_grids = emissive_grids;
      SceneBuilder b = fire.builder({kSide, kSide});
      if (rival.change) rival.change(b);
      return b;
    };
    const SceneBuilder on = scene(1), off = scene(-1);
    ASSERT_TRUE(world_of(on)->emissive.any()) << rival.name;
    ASSERT_FALSE(world_of(off)->emissive.any()) << rival.name;
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr(rival.variant)) << rival.name;
    expect_same_quarters(rival.name, level, quarters_of(on, rival.spp, kSeeds, 100),
                         quarters_of(off, 4 * rival.spp, kSeeds, 900), kSeeds);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
