// Choosing lights by place brings the same image as choosing them by power alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/property/quarters.h"
#include "tests/support/lamp_rooms.h"
#include "tests/support/significance.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

TEST(LocalLights, GiveTheSameImageAsTheTableOfAllLights) {
  constexpr int kSeeds = 24;
  Tests tests("property/local_lights");
  struct Rival {
    const char* name;
    LampRooms rooms;
    std::function<void(SceneBuilder&)> change = [](SceneBuilder&) {};
    const char* variant = "";  // what the name of the path tracer must contain
    std::uint64_t spp = 24;
  };
  // A window in the wall of the left room that is behind the camera's right shoulder
  const auto open = [](SceneBuilder& b) {
    b.scene.shapes.erase(b.scene.shapes.begin() + 2);
    b.scene.integrator.sky_portals = -1;
  };
  const auto sun = [=](SceneBuilder& b) {
    open(b);
    b.scene.emitters.push_back(DirectionalEmitter{{1, -.7, -.2}, {3, 3, 2}});
  };
  const auto connected = [=](SceneBuilder& b) {
    sun(b);
    b.scene.integrator.light_vertices = 1;
  };
  const auto wide_sun = [=](SceneBuilder& b) {
    open(b);
    b.scene.emitters.push_back(DirectionalEmitter{{1, -.7, -.2}, {3, 3, 2}, 25});
  };
  const auto sky = [=](SceneBuilder& b) {
    open(b);
    SkyImage image(16, 9, 1);
    image.set(12, 3, {30, 20, 10});
    add_sky(b, image);
  };
  const auto portals = [=](SceneBuilder& b) {
    sky(b);
    b.environment(.3);
    b.scene.integrator.sky_portals = 1;
  };
  const auto shared = [](SceneBuilder& b) { b.scene.integrator.path_reuse = 8; };
  const auto shared_sky = [=](SceneBuilder& b) {
    sky(b);
    shared(b);
  };
  const auto shared_sun = [=](SceneBuilder& b) {
    wide_sun(b);
    shared(b);
  };
  const auto by_path = [](SceneBuilder& b) { b.scene.integrator.name = "path"; };
  // Most lamps are hit by paths that were scattered on a camera segment
  const auto camera_points = [=](SceneBuilder& b) {
    sun(b);
    b.scene.phases[0] = HgPhase{.9};
    b.scene.integrator.max_depth = 2;
    b.scene.integrator.light_vertices = -1;
    b.scene.integrator.camera_points = 2;
  };
  const Rival rivals[] = {
      {"lamps", {}},
      {"lamps, glossy, by `path`", {.glossy = true}, by_path},
      {"lamps without extent in fog", {.points = true, .fog = .4}},
      {"lamps in fog, and a sun at points on camera segments", {.fog = .2}, camera_points, "aimed", 48},
      {"lamps in a grid", {.fog = .4, .grid = true}},
      {"many lamps", {.lamps = 40}},
      {"shared paths", {.fog = .4}, shared, "shared"},
      {"shared paths under a sky", {.glossy = true}, shared_sky, "shared"},
      {"shared paths, wide sun", {}, shared_sun, "shared"},
      {"sun, connected", {.fog = .3, .grid = true}, connected, "connected"},
      {"wide sun", {}, wide_sun},
      {"sky with an image", {.glossy = true}, sky},
      {"sky through portals", {}, portals}};
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const Rival& rival : rivals) {
    const auto scene = [&](int local_lights) {
      LampRooms rooms = rival.rooms;
      rooms.local_lights = local_lights;
      SceneBuilder b = rooms.builder();
      rival.change(b);
      return b;
    };
    const SceneBuilder on = scene(1), off = scene(-1);
    ASSERT_TRUE(world_of(on)->lights.local()) << rival.name;
    ASSERT_FALSE(world_of(off)->lights.local()) << rival.name;
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr(rival.variant)) << rival.name;
    expect_same_quarters(rival.name, level, quarters_of(on, rival.spp, kSeeds, 100),
                         quarters_of(off, 2 * rival.spp, kSeeds, 900), kSeeds);
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
