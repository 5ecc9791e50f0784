// Choosing among many lights by a tree brings the same image as choosing them by power alone.
#include <gtest/gtest.h>

#include "tests/property/quarters.h"
#include "tests/support/lamp_rooms.h"
#include "tests/support/significance.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

// Light is sampled at points of the camera's segments, for which it is chosen before the point is known; and
// paths that are scattered there hit the lamps.
TEST(LightTree, GivesTheSameImageAsTheTableWithPointsOnCameraSegments) {
  constexpr int kSeeds = 24;
  Tests tests("property/light_tree");
  const auto scene = [](int light_tree) {
    SceneBuilder b = LampRooms{.fog = .15, .grid = true, .lamps = 40, .local_lights = -1}.builder();
    b.scene.phases[0] = HgPhase{.9};
    b.scene.shapes.erase(b.scene.shapes.begin() + 2);  // the wall on the left
    b.scene.emitters.push_back(DirectionalEmitter{{1, -.7, -.2}, {.3, .3, .2}});
    b.scene.integrator.max_depth = 2;
    b.scene.integrator.light_vertices = -1;
    b.scene.integrator.light_tree = light_tree;
    return b;
  };
  const SceneBuilder on = scene(0), off = scene(-1);
  for (const SceneBuilder* b : {&on, &off}) ASSERT_GT(world_of(*b)->camera_points, 0);
  ASSERT_TRUE(world_of(on)->lights.has_tree());
  ASSERT_FALSE(world_of(off)->lights.has_tree());
  expect_same_quarters("thin steam", tests.level(kQuarters), quarters_of(on, 64, kSeeds, 100),
                       quarters_of(off, 96, kSeeds, 900), kSeeds);
  tests.close();
}

}  // namespace
}  // namespace ls::test
