// The choice of lights by place: which scenes use it, how much noise it removes, and that it does not depend
// on the seed, the crop or the threads. That the image stays the same is tested in
// tests/property/local_lights_test.cpp.
#include <gtest/gtest.h>

#include "tests/support/lamp_room.h"
#include "tests/support/lamp_rooms.h"
#include "tests/support/render_check.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::LampRooms;
using test::SceneBuilder;

bool is_local(const SceneBuilder& b) { return test::world_of(b)->lights.local() != nullptr; }
template <class Change>
bool is_local_with(Change change, LampRooms rooms = {}) {
  SceneBuilder b = rooms.builder();
  change(b.scene);
  return is_local(b);
}

TEST(LocalLights, AreUsedIfMostLampsAreInOtherRooms) {
  EXPECT_TRUE(is_local(LampRooms{}.builder()));
  for (const bool points : {false, true})
    EXPECT_TRUE(is_local(LampRooms{.points = points, .fog = .3}.builder())) << points;
  EXPECT_TRUE(is_local(LampRooms{.lamps = 40}.builder())) << "instead of a tree";
}

TEST(LocalLights, AreLeftOutWhereTheyAreNotNeeded) {
  EXPECT_FALSE(is_local_with([](Scene& s) { s.integrator.local_lights = -1; }));
  EXPECT_FALSE(is_local(test::LampRoom{}.builder())) << "one lamp";
  for (const int lamps : {63, 64})  // this many in the right room, and one in the left room
    EXPECT_EQ(is_local(LampRooms{.lamps = lamps, .local_lights = 1}.builder()), lamps == 63);
  EXPECT_FALSE(is_local_with([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }, {.fog = .3}));
  EXPECT_TRUE(is_local_with([](Scene& s) { s.integrator.name = "path"; }));
}

// Two equal lamps shine everywhere. The table of all lights is nearly as good, so learning leaves the image
// unchanged.
TEST(LocalLights, AreUnusedWhereTheyDoNotPay) {
  SceneBuilder room = test::SunnyRoom{.light_vertices = -1}.builder();
  room.scene.integrator.path_reuse = -1;
  room.scene.emitters = {PointEmitter{{-.5, .2, 0}, {1, 1, 1}}, PointEmitter{{.5, .2, 0}, {1, 1, 1}}};
  SceneBuilder asked = room, off = room;
  asked.scene.integrator.local_lights = 1;
  off.scene.integrator.local_lights = -1;
  EXPECT_TRUE(is_local(asked));
  EXPECT_FALSE(is_local(room));
  const auto sums = [](const SceneBuilder& b) {
    return render_tile(*test::world_of(b, 3), {0, 0, 16, 16}, {0, 4}, nullptr, nullptr).sums;
  };
  EXPECT_EQ(sums(room), sums(off));
  EXPECT_NE(sums(asked), sums(off));
}

TEST(LocalLights, AreTheSameForEverySeed) {
  const SceneBuilder rooms = LampRooms{.fog = .3}.builder();
  const auto one = test::world_of(rooms, 3), two = test::world_of(rooms, 4);
  RandomStream random(1);
  for (int i = 0; i < 100; ++i) {
    const V3 p(4 * random.uniform() - 2, 2 * random.uniform() - 1, 2 * random.uniform() - 1);
    const auto probability = [&](const World& w) { return w.lights.local()->probability(0, p, {0, 1, 0}); };
    EXPECT_EQ(probability(*one), probability(*two));
  }
}

TEST(LocalLights, AreTheSameForAnyNumberOfThreadsAndForEveryCrop) {
  const auto sums = [](SceneBuilder b, int threads, PixelRect tile) {
    const auto world = test::world_of(b, 3, threads);
    EXPECT_TRUE(world->lights.local());
    return render_tile(*world, tile, {0, 4}, nullptr, nullptr).sums;
  };
  const SceneBuilder rooms = LampRooms{.glossy = true, .fog = .2}.builder({64, 64});
  const auto one = sums(rooms, 1, {16, 16, 24, 24});
  for (const int threads : {2, 5}) EXPECT_EQ(sums(rooms, threads, {16, 16, 24, 24}), one) << threads;
  SceneBuilder crop = rooms;
  crop.scene.film.crop_offset = {16, 16};
  crop.scene.film.crop_size = {8, 8};
  EXPECT_EQ(sums(crop, 1, {0, 0, 8, 8}), one);
}

TEST(LocalLights, ReduceNoise) {
  const auto noise = [](int local_lights) {
    return test::estimate(LampRooms{.local_lights = local_lights}.builder({24, 24}), 32).standard_error[1];
  };
  // The two images are the same in each run. Each standard error is that of a sum over 576 pixels, so it is
  // accurate to about 1 / sqrt(2 * 576) = 3 %, and less if few bright pixels dominate. One of seven lamps
  // lights most of what is visible.
  EXPECT_LT(noise(0), .7 * noise(-1));
}

}  // namespace
}  // namespace ls::render
