// Surfaces that lie on each other.
#include <gtest/gtest.h>

#include "tests/support/render_check.h"
#include "worker/render/coincident.h"
#include "worker/render/world.h"

namespace ls::render {
namespace {

using test::SceneKit;
using test::translate;
using test::operator*;

// Fog that stands on a floor, lit from below only: what gets through the floor is an error.
// All of it is turned by `turn`: rounded corners of floor and box then lie in no common plane.
std::uint64_t lit_from_below(const Transform& turn, double floor, bool light_is_a_plane) {
  SceneKit kit({4, 4});
  const MediumIndex fog = kit.homogeneous({.5, .5, .5}, {.9, .9, .9});
  kit.container(CubeShape{}, turn * translate({0, 0, 1}) * test::scale(2, 2, 1), kit.null(), fog);
  kit.shape(RectangleShape{}, turn * test::scale(floor), kit.diffuse(.5));
  const auto turned = [&](const Vec3& p) {
    const auto& m = turn.m;
    return Vec3{m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[4] * p[0] + m[5] * p[1] + m[6] * p[2],
                m[8] * p[0] + m[9] * p[1] + m[10] * p[2]};
  };
  if (light_is_a_plane) {
    const TextureIndex light = kit.texture({1, 1, 1});
    kit.shape(RectangleShape{}, turn * translate({0, 0, -50}) * test::scale(40), kit.diffuse(0)).emitter =
        AreaEmitter{light};
  } else {
    kit.scene.emitters.push_back(DirectionalEmitter{turned({0, 0, 1}), {1, 1, 1}});
  }
  kit.look(turned({0, -6, 3}), turned({0, 0, .5}), 40, turned({0, 0, 1}));
  const auto world = test::world_of(kit);
  std::uint64_t leaks = 0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (std::uint64_t s = 0; s < 400; ++s) leaks += render_sample(*world, x, y, s).rgb[0] > 0;
  return leaks;
}

TEST(FogOnAFloor, LetsNoLightThroughTheFloor) {
  for (const Transform& turn : {Transform{}, test::rotate_x(17) * test::rotate_y(31)}) {
    EXPECT_EQ(lit_from_below(turn, 4, false), 0u);
    EXPECT_EQ(lit_from_below(turn, 40, false), 0u);
    EXPECT_EQ(lit_from_below(turn, 40, true), 0u);  // no way round the edge reaches the light
  }
}

TEST(Coincident, AreFoundWhereSurfacesShareAPlaceOnly) {
  const auto found = [](const ls::Geometry& g, const Transform& t) {
    SceneKit kit({1, 1});
    const MediumIndex fog = kit.homogeneous({1, 1, 1}, {0, 0, 0});
    kit.container(CubeShape{}, {}, kit.null(), fog);
    kit.shape(g, t, kit.diffuse(.5));
    return test::world_of(kit)->coincident;
  };
  EXPECT_TRUE(found(RectangleShape{}, translate({0, 0, -1}) * test::scale(5)));
  EXPECT_TRUE(found(DiskShape{}, translate({.5, 0, -1}) * test::scale(.1)));
  EXPECT_FALSE(found(RectangleShape{}, translate({0, 0, -1.001}) * test::scale(5)));
  EXPECT_FALSE(found(RectangleShape{}, translate({3, 0, -1})));  // in the plane, but beside it
  EXPECT_FALSE(found(RectangleShape{}, test::scale(5)));         // across it
  EXPECT_FALSE(found(CubeShape{}, test::scale(.5)));
  EXPECT_TRUE(found(CubeShape{}, {}));
  EXPECT_FALSE(found(SphereShape{}, {}));
}

TEST(Coincident, AreFoundAmongRoundShapes) {
  const auto found = [](double radius) {
    SceneKit kit({1, 1});
    const MediumIndex fog = kit.homogeneous({1, 1, 1}, {0, 0, 0});
    kit.container(SphereShape{}, {}, kit.null(), fog);
    kit.shape(SphereShape{}, test::scale(radius), kit.glass(1.5));
    return test::world_of(kit)->coincident;
  };
  EXPECT_TRUE(found(1));
  EXPECT_FALSE(found(1.001));
}

// All that lies between two points, whatever its kind, each once.
TEST(Coincident, AreAllListedByTheAccelerationStructure) {
  SceneKit kit({1, 1});
  const BsdfIndex null = kit.null(), grey = kit.diffuse(.5);
  for (int i = 0; i < 3; ++i) kit.shape(RectangleShape{}, test::scale(1 + i), i == 1 ? grey : null);
  kit.shape(DiskShape{}, {}, null);
  kit.shape(SphereShape{}, translate({0, 0, 1}), null);
  const auto w = test::world_of(kit);
  ASSERT_TRUE(w->coincident);
  const auto at = [&](double z) { return V3((V3d(.1, .2, z) - w->geometry.center) * w->geometry.scale); };
  EXPECT_EQ(w->accel.between(at(-.01), at(.001)).count, 4);
  EXPECT_EQ(w->accel.between(at(-.01), at(.1)).count, 5);
  EXPECT_EQ(w->accel.between(at(.1), at(.5)).count, 0);
}

// A glass plate and the fog in it, with the same faces: both are crossed or none.
TEST(Coincident, MediaBeginWithTheGlassThatTheyFill) {
  SceneKit kit({1, 1});
  HomogeneousMedium m;
  m.sigma_t = {0, 0, 0};
  m.phase = kit.phase(0);
  m.emission = {1, 1, 1};
  const auto fog = SceneKit::push<MediumTag>(kit.scene.media, m);
  kit.container(CubeShape{}, {}, kit.null(), fog);
  kit.shape(CubeShape{}, {}, kit.glass(1.0001));
  kit.look({-5, .1, .2}, {0, .1, .2}, 1e-4);
  const auto w = test::world_of(kit);
  int whole = 0;
  for (std::uint64_t s = 0; s < 64; ++s) {
    const double light = render_sample(*w, 0, 0, s).rgb[0];
    whole += std::abs(light - 2) < 1e-2;  // but for the share 2.5e-9 that is reflected
  }
  EXPECT_EQ(whole, 64);
}

}  // namespace
}  // namespace ls::render
