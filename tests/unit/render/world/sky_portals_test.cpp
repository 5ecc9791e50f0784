// Which scenes look for the sky through portals, what that brings, and that it depends on nothing that it
// should not depend on. That the image stays the same is tested in tests/property/sky_portals_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_check.h"
#include "tests/support/sky_room.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::SkyRoom;

bool has_portals(const SceneBuilder& b) { return test::world_of(b)->lights.portals() != nullptr; }
template <class Change>
bool has_portals_with(Change change, SkyRoom room = {}) {
  SceneBuilder b = room.builder();
  change(b.scene);
  return has_portals(b);
}

TEST(SkyPortals, AreUsedWhereTheSkyIsRarelySeen) {
  for (const bool image : {false, true})
    for (const double fog : {0., .3}) EXPECT_TRUE(has_portals(SkyRoom{.image = image, .fog = fog}.builder()));
  EXPECT_FALSE(has_portals(test::sky_yard({32, 16}))) << "half of the sky is seen from everywhere";
  EXPECT_FALSE(has_portals_with([](Scene& s) {
    s.emitters.push_back(PointEmitter{{0, .5, 0}, {30, 30, 30}});
  })) << "a lamp brings nearly all light";
}

TEST(SkyPortals, AreLeftOutWhereTheyAreNotNeeded) {
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.sky_portals = -1; }));
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.emitters.clear(); })) << "no sky";
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.max_depth = 1; }))
      << "light that is not scattered";
  EXPECT_FALSE(has_portals_with([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }, {.fog = .3}));
  EXPECT_TRUE(has_portals_with([](Scene& s) { s.integrator.name = "path"; }));
}

// A constant sky that is sampled as a light is not looked for a second time by other techniques, and is the
// same light as before where portals do not pay.
TEST(SkyPortals, LeaveNoTraceWhereTheyDoNotPay) {
  SceneBuilder yard = test::sky_yard({32, 16}), off = yard;
  off.scene.integrator.sky_portals = -1;
  const auto sums = [](const SceneBuilder& b) {
    return render_tile(*test::world_of(b, 3), {0, 0, 32, 16}, {0, 4}, nullptr, nullptr).sums;
  };
  EXPECT_EQ(sums(yard), sums(off));
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
  // Always the same images. Their standard errors are those of sums over 576 pixels, so each is known to
  // about 1 / sqrt(2 * 576) = 3 %, and less well where few bright pixels decide; portals take more than half
  // away.
  for (const bool image : {false, true}) EXPECT_LT(noise(0, image), .7 * noise(-1, image)) << image;
}

}  // namespace
}  // namespace ls::render
