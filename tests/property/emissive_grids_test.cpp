// Looking for emissive grids by next-event estimation brings the same image as meeting their light by chance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

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
  const Rival rivals[] = {{"fire", {}},
                          {"fire by absorption", {.absorbed = true}},
                          {"hot fire over a glossy floor", {.glossy = true, .black_body = true}, {}, "", 64},
                          {"fire in fog", {.fog = true}, {}, "", 96},
                          {"coloured fire in coloured fog", {.fog = true, .coloured = true}, {}, "", 96},
                          {"fire in fog with a lamp", {.fog = true}, lamp, "aimed"},
                          {"fire behind thin glass", {}, thin_glass},
                          {"fire across haze that glows", {}, overlap},
                          {"fire and a ball that reflections do not show", {}, unseen}};
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
