// Looking for the sky through portals brings the same image as looking for it everywhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/property/quarters.h"
#include "tests/support/significance.h"
#include "tests/support/sky_room.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

TEST(SkyPortals, GiveTheSameImageAsPathsWithoutThem) {
  constexpr int kSeeds = 24;
  Tests tests("property/sky_portals");
  struct Rival {
    const char* name;
    SkyRoom room;
    std::function<void(SceneBuilder&)> change = [](SceneBuilder&) {};
    const char* variant = "";  // what the name of the path tracer must contain
    std::uint64_t spp = 24;
  };
  const auto shared = [](SceneBuilder& b) { b.scene.integrator.path_reuse = 8; };
  const auto sun = [](SceneBuilder& b) {
    b.scene.emitters.push_back(DirectionalEmitter{{-1, -1, -.1}, {2, 2, 2}});
    b.scene.integrator.light_vertices = 1;
  };
  const auto wide_sun = [](SceneBuilder& b) {
    b.scene.emitters.push_back(DirectionalEmitter{{-1, -.6, -.1}, {2, 2, 2}, 20});
  };
  const auto lamps = [](SceneBuilder& b) {  // enough for a tree of lights
    for (int i = 0; i < 40; ++i)
      b.scene.emitters.push_back(PointEmitter{{-.9 + .04 * i, .8, -.5}, {.01, .01, .02}});
  };
  const auto points = [](SceneBuilder& b) { b.scene.integrator.camera_points = 2; };
  const Rival rivals[] = {
      {"constant sky", {.image = false}},
      {"constant sky, glossy", {.image = false, .glossy = true}},
      {"constant sky in fog", {.image = false, .fog = .5}},
      {"image", {}},
      {"image, glossy", {.glossy = true}},
      {"image in fog", {.fog = .5}},
      {"image in a grid", {.fog = .5, .grid = true}},
      {"image in fog, points on camera segments", {.fog = .3}, points, "aimed"},
      {"image, shared paths", {}, shared, "shared"},
      {"constant sky, shared paths in fog", {.image = false, .fog = .5}, shared, "shared"},
      {"image and sun", {}, sun, "connected"},
      {"image and wide sun", {}, wide_sun},
      {"constant sky and lamps", {.image = false}, lamps}};
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const Rival& rival : rivals) {
    const auto scene = [&](int sky_portals) {
      SkyRoom room = rival.room;
      room.sky_portals = sky_portals;
      SceneBuilder b = room.builder();
      rival.change(b);
      return b;
    };
    const SceneBuilder on = scene(1), off = scene(-1);
    ASSERT_TRUE(world_of(on)->lights.portals()) << rival.name;
    ASSERT_FALSE(world_of(off)->lights.portals()) << rival.name;
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr(rival.variant)) << rival.name;
    expect_same_quarters(rival.name, level, quarters_of(on, rival.spp, kSeeds, 100),
                         quarters_of(off, 4 * rival.spp, kSeeds, 900), kSeeds);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
