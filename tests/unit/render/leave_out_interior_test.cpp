// Leaving out what no light gets into, and phase functions that nothing asks, does not change a bit.
#include <gtest/gtest.h>

#include <random>

#include "common/scene/prune.h"
#include "common/scene/validate.h"
#include "tests/support/render_check.h"
#include "worker/render/world.h"

namespace ls::render {
namespace {

using test::SceneKit;
using test::translate;
using test::operator*;

TileResult render(const SceneKit& kit, std::string* variant = nullptr) {
  const auto world = test::world_of(kit);
  if (variant) *variant = describe(*world).variant;
  return render_tile(*world, {0, 0, 12, 8}, {0, 64}, nullptr, nullptr);
}

SceneKit room() {
  SceneKit kit({12, 8});
  kit.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(3), kit.diffuse(.6));
  kit.scene.emitters.push_back(PointEmitter{{1, -1, 1.5}, {1, 1, 1}});
  kit.environment(.1);
  kit.look({0, -5, 1}, {0, 0, 0}, 40);
  return kit;
}
BsdfIndex whole(SceneKit& kit) {
  const BsdfIndex b = kit.diffuse(.7);
  return kit.bsdf(TwoSidedBsdf{b, b});
}
MediumIndex cloud(SceneKit& kit, int channels = 3) {
  std::vector<float> values;
  for (int i = 0; i < 8 * channels; ++i) values.push_back(static_cast<float>(1 + i % 5));
  return kit.heterogeneous(kit.grid({2, 2, 2}, values, translate({-1, -1, -1}) * test::scale(2), channels),
                           {.9, .9, .9}, 1, .5);
}
// A ball of fog that light gets into, beside all else.
void add_fog(SceneKit& kit, double albedo = .8, double g = 0) {
  kit.container(SphereShape{}, translate({-1, -.5, .2}) * test::scale(.5), kit.null(),
                kit.homogeneous({.8, .8, .8}, {albedo, albedo, albedo}, g));
}

// What pruning takes out of it, which must be a medium, changes nothing. The instantiation is the one of what
// is left.
void expect_same_without_medium(SceneKit kit, const std::string& variant) {
  std::string before, after;
  const TileResult whole_scene = render(kit, &before);
  const std::size_t media = kit.scene.media.size();
  kit.scene = scene::pruned(kit.scene, {}).scene;
  EXPECT_LT(kit.scene.media.size(), media);
  EXPECT_EQ(render(kit, &after).sums, whole_scene.sums);
  EXPECT_NE(before, variant);
  EXPECT_EQ(after, variant);
}

TEST(LeaveOutInteriors, OfATwoSidedBallOnAFloor) {
  SceneKit kit = room();
  kit.container(SphereShape{}, translate({0, 0, -.6}) * test::scale(.5), whole(kit), cloud(kit));
  expect_same_without_medium(std::move(kit), "surfaces");
}

TEST(LeaveOutInteriors, OfACubeSunkIntoAFloorWhoseOutsideIsNamed) {
  SceneKit kit = room();
  const MediumIndex chromatic = kit.homogeneous({1, 2, 4}, {.9, .5, .2});
  const MediumIndex thin = kit.homogeneous({.05, .05, .05}, {.9, .9, .9});
  kit.container(CubeShape{}, translate({0, 0, -.8}) * test::rotate_x(20) * test::scale(.5), whole(kit),
                chromatic)
      .exterior = thin;
  kit.container(SphereShape{}, test::scale(20), kit.null(), thin);
  kit.scene.sensor.medium = thin;
  expect_same_without_medium(std::move(kit), "homogeneous grey media");
}

TEST(LeaveOutInteriors, BehindABlackBackBesideGlass) {
  SceneKit kit = room();
  kit.container(CubeShape{}, test::rotate_x(20) * test::scale(.5), kit.diffuse(.7), cloud(kit));
  kit.shape(CubeShape{}, test::rotate_x(20) * test::scale(.5), kit.glass(1.5));
  expect_same_without_medium(std::move(kit), "surfaces");
}

TEST(LeaveOutInteriors, BesideMediaThatStay) {
  SceneKit kit = room();
  kit.container(SphereShape{}, translate({.8, 0, -.6}) * test::scale(.4), whole(kit), cloud(kit));
  add_fog(kit);
  expect_same_without_medium(std::move(kit), "homogeneous grey media");
}

TEST(LeaveOutInteriors, BesideMediaThatOverlap) {
  SceneKit kit = room();
  kit.container(CubeShape{}, translate({.8, 0, -.6}) * test::scale(.3), whole(kit), cloud(kit));
  add_fog(kit);
  kit.container(SphereShape{}, translate({-.7, -.5, .2}) * test::scale(.5), kit.null(),
                kit.homogeneous({2, 1, .5}, {.3, .3, .3}));
  const TileResult before = render(kit);
  kit.scene = scene::pruned(kit.scene, {}).scene;
  EXPECT_EQ(kit.scene.media.size(), 2u);
  EXPECT_EQ(render(kit).sums, before.sums);
}

// What pruning would do wrong if it took more: the medium shows.
TEST(LeaveOutInteriors, OfGlassShow) {
  SceneKit kit = room();
  Shape& ball = kit.container(SphereShape{}, test::scale(.5), kit.glass(1.5), cloud(kit));
  const TileResult before = render(kit);
  EXPECT_EQ(scene::pruned(kit.scene, {}).scene.media.size(), 1u);
  ball.interior.reset();
  EXPECT_NE(render(kit).sums, before.sums);
}

// A room of shapes of all kinds, turned and laid into each other as it comes, with fog of several kinds in
// and about them; sometimes around the camera, too.
SceneKit random_room(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto one_of = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const auto within = [&](double lo, double hi) { return lo + (hi - lo) * (random() % 1024) / 1023.; };
  SceneKit kit = room();
  const BsdfIndex grey = kit.diffuse(.7), glass = kit.glass(1.4);
  const BsdfIndex both = kit.bsdf(TwoSidedBsdf{grey, grey});
  const BsdfIndex half =
      kit.bsdf(BlendBsdf{kit.texture({.3, .3, .3}), grey,
                         kit.bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, kit.texture({.8, .8, .8})})});
  const BsdfIndex bsdfs[] = {grey, both, both, kit.mirror(), half, glass, kit.null()};
  const ls::Geometry shapes[] = {SphereShape{}, CubeShape{},      SphereShape{},
                                 CubeShape{},   RectangleShape{}, CylinderShape{}};
  std::vector<MediumIndex> media;
  for (int i = 0; i < 5; ++i) {
    const double k = within(.1, 2);
    media.push_back(kit.homogeneous({k, k * (1 + one_of(2)), k}, {.8, .8, .8}, one_of(2) ? .5 : 0));
  }
  kit.glow(media.back(), {.2, .1, 0});
  for (int i = 0; i < 6; ++i) {
    const Transform place = translate({within(-1.5, 1.5), within(-1.5, 1.5), within(-1, 1)}) *
                            test::rotate_x(90. * one_of(4) + 7 * one_of(2)) * test::scale(within(.2, .8)) *
                            test::scale(one_of(4) ? 1 : -1, 1, 1);
    Shape& s = kit.container(shapes[one_of(6)], place, bsdfs[one_of(7)], media[one_of(5)]);
    s.flip_normals = one_of(5) == 0;
    if (one_of(3) == 0) s.exterior = media[one_of(2)];
    if (one_of(8) == 0) s.emitter = AreaEmitter{kit.texture({1, 2, 3})};
  }
  if (one_of(3) == 0) kit.scene.sensor.medium = media[one_of(5)];
  if (one_of(4) == 0) kit.scene.sensor.near_clip = within(1, 6);
  if (one_of(4) == 0) kit.look({within(-1, 1), within(-1, 1), within(-.5, 1)}, {0, 0, 0}, 60);
  return kit;
}

TEST(LeaveOutInteriors, OfRandomRooms) {
  int pruned = 0;
  for (std::uint32_t seed = 0; seed < 150; ++seed) {
    SceneKit kit = random_room(seed);
    kit.scene = scene::compacted(kit.scene);  // media are drawn in the order of their numbers
    const Scene left = scene::pruned(kit.scene, {}).scene;
    EXPECT_EQ(scene::pruned(left, {}).scene, left) << seed;
    if (left.media.size() == kit.scene.media.size()) continue;
    ++pruned;
    const TileResult before = render(kit);
    kit.scene = left;
    EXPECT_EQ(render(kit).sums, before.sums) << seed;
  }
  EXPECT_GT(pruned, 20);
}

TEST(LeaveOutPhases, OfMediaThatScatterNothing) {
  for (const bool overlapping : {false, true}) {
    SceneKit kit = room();
    add_fog(kit, 0, .7);
    const VolumeIndex v =
        kit.grid({2, 2, 2}, {0, 1, 2, 3, 4, 5, 6, 7}, translate({-1, -1, -1}) * test::scale(2));
    kit.container(CubeShape{}, translate({overlapping ? -.5 : .5, 0, 0}) * test::scale(.4), kit.null(),
                  kit.heterogeneous(v, {0, 0, 0}, 1, -.5));
    const TileResult before = render(kit);
    kit.scene = scene::pruned(kit.scene, {}).scene;
    EXPECT_EQ(kit.scene.phases.size(), 1u);
    EXPECT_EQ(render(kit).sums, before.sums);
  }
}

}  // namespace
}  // namespace ls::render
