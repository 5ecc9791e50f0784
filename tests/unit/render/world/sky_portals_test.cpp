// Portals: which scenes use them, how much noise they remove, and that they do not depend on the crop or the
// threads. That the image stays the same is tested in tests/property/sky_portals_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "tests/support/sky_room.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::SkyImage;
using test::SkyRoom;

bool has_portals(const SceneBuilder& b) { return test::world_of(b)->lights.portals() != nullptr; }
template <class Change>
bool has_portals_with(Change change, SkyRoom room = {}) {
  SceneBuilder b = room.builder();
  change(b.scene);
  return has_portals(b);
}

TEST(SkyPortals, AreUsedIfTheSkyIsRarelyVisible) {
  for (const bool image : {false, true})
    for (const double fog : {0., .3}) EXPECT_TRUE(has_portals(SkyRoom{.image = image, .fog = fog}.builder()));
  EXPECT_TRUE(has_portals_with([](Scene& s) { s.integrator.camera_points = 0; }, {.fog = .1}))
      << "light is found at points of camera segments, too";
  EXPECT_FALSE(has_portals(test::sky_yard({32, 16}))) << "half of the sky is seen from everywhere";
}

// In these scenes paths find portals that do not pay: the image is that without portals.
TEST(SkyPortals, AreUnusedWhereTheyDoNotPay) {
  const auto with = [](auto&& change, SkyRoom room) {
    SceneBuilder b = room.builder();
    change(b);
    return b;
  };
  const auto lamps = [](SceneBuilder& b) {  // enough for a tree of lights
    for (int i = 0; i < 40; ++i)
      b.scene.emitters.push_back(PointEmitter{{-.9 + .04 * i, .8, -.5}, {2, 2, 2}});
  };
  const auto wide_sun = [](SceneBuilder& b) {
    b.scene.emitters.push_back(DirectionalEmitter{{-1, -1, -.1}, {2, 2, 2}, 5});
  };
  // A sky whose light comes almost entirely from the sun, which shines through the slit
  const auto sunny = [](SceneBuilder& b) {
    b.scene.emitters.clear();
    SkyImage sky(512, 257, .01f);
    sky.set(127, 64, {9e4, 9e4, 9e4});
    test::add_sky(b, sky);
  };
  const SceneBuilder rooms[] = {with(lamps, {.image = false}), with(lamps, {}),
                                with(wide_sun, {.image = false}), with(sunny, {})};
  for (const SceneBuilder& room : rooms) {
    const auto number = &room - rooms;
    SceneBuilder asked = room, off = room;
    asked.scene.integrator.sky_portals = 1;
    off.scene.integrator.sky_portals = -1;
    EXPECT_TRUE(has_portals(asked)) << number;
    EXPECT_FALSE(has_portals(room)) << number;
    const auto sums = [](const SceneBuilder& b) {
      return render_tile(*test::world_of(b, 3), {0, 0, 16, 16}, {0, 4}, nullptr, nullptr).sums;
    };
    EXPECT_EQ(sums(room), sums(off)) << number;
  }
}

TEST(SkyPortals, AreLeftOutWhereTheyAreNotNeeded) {
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.sky_portals = -1; }));
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.emitters.clear(); })) << "no sky";
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.max_depth = 1; }))
      << "light that is not scattered";
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }, {.fog = .3}));
  EXPECT_TRUE(has_portals_with([](Scene& s) { s.integrator.name = "path"; }));
}

TEST(SkyPortals, AreTheSameForAnyNumberOfThreadsAndForEveryCrop) {
  const auto sums = [](SceneBuilder b, int threads, PixelRect tile) {
    const auto world = test::world_of(b, 3, threads);
    EXPECT_TRUE(world->lights.portals());
    return render_tile(*world, tile, {0, 4}, nullptr, nullptr).sums;
  };
  const SceneBuilder room = SkyRoom{.glossy = true, .fog = .3}.builder({64, 64});
  const auto one = sums(room, 1, {16, 16, 24, 24});
  for (const int threads : {2, 5}) EXPECT_EQ(sums(room, threads, {16, 16, 24, 24}), one) << threads;
  SceneBuilder crop = room;
  crop.scene.film.crop_offset = {16, 16};
  crop.scene.film.crop_size = {8, 8};
  EXPECT_EQ(sums(crop, 1, {0, 0, 8, 8}), one);
}

TEST(SkyPortals, ReduceNoise) {
  const auto noise = [](int sky_portals, bool image) {
    return test::estimate(SkyRoom{.image = image, .sky_portals = sky_portals}.builder({24, 24}), 32)
        .standard_error[1];
  };
  // The two images are the same in each run. Each standard error is that of a sum over 576 pixels, so it is
  // accurate to about 1 / sqrt(2 * 576) = 3 %, and less if few bright pixels dominate. Portals remove more
  // than half of the noise.
  for (const bool image : {false, true}) EXPECT_LT(noise(0, image), .7 * noise(-1, image)) << image;
}

}  // namespace
}  // namespace ls::render
