// Leaving out media that no light reaches, and phase functions of media that do not scatter, does not change
// a bit.
#include <gtest/gtest.h>

#include <random>

#include "core/scene/analysis/prune.h"
#include "core/scene/schema/validate.h"
#include "tests/support/render_check.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

TileResult render(const SceneBuilder& builder, std::string* variant = nullptr) {
  const auto world = test::world_of(builder);
  if (variant) *variant = describe(*world).variant;
  return render_tile(*world, {0, 0, 12, 8}, {0, 64}, nullptr, nullptr);
}

SceneBuilder room() {
  SceneBuilder builder({12, 8});
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * test::scale(3), builder.diffuse(.6));
  builder.scene.emitters.push_back(PointEmitter{{1, -1, 1.5}, {1, 1, 1}});
  builder.environment(.1);
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  // Dead parts add segments to paths. Camera points and lamp directions would draw random numbers by segment,
  // so they are switched off
  builder.scene.integrator.camera_points = -1;
  builder.scene.integrator.phase_only = true;
  return builder;
}
BsdfIndex whole(SceneBuilder& builder) {
  const BsdfIndex b = builder.diffuse(.7);
  return builder.bsdf(TwoSidedBsdf{b, b});
}
MediumIndex cloud(SceneBuilder& builder, int channels = 3) {
  std::vector<float> values;
  for (int i = 0; i < 8 * channels; ++i) values.push_back(static_cast<float>(1 + i % 5));
  return builder.heterogeneous(
      builder.grid({2, 2, 2}, values, translate({-1, -1, -1}) * test::scale(2), channels), {.9, .9, .9}, 1,
      .5);
}
// A ball of fog that light reaches, in addition to the rest of the scene.
void add_fog(SceneBuilder& builder, double albedo = .8, double g = 0) {
  builder.container(SphereShape{}, translate({-1, -.5, .2}) * test::scale(.5), builder.null(),
                    builder.homogeneous({.8, .8, .8}, {albedo, albedo, albedo}, g));
}

// Expects that pruning removes at least one medium and changes no bit, and that the pruned scene is rendered
// by the given instantiation.
void expect_same_without_medium(SceneBuilder builder, const std::string& variant) {
  std::string before, after;
  const TileResult whole_scene = render(builder, &before);
  const std::size_t media = builder.scene.media.size();
  builder.scene = scene::pruned(builder.scene, {}).scene;
  EXPECT_LT(builder.scene.media.size(), media);
  EXPECT_EQ(render(builder, &after).sums, whole_scene.sums);
  EXPECT_NE(before, variant);
  EXPECT_EQ(after, variant);
}

TEST(LeaveOutInteriors, TwoSidedBallOnAFloorKeepsItsPixels) {
  SceneBuilder builder = room();
  builder.container(SphereShape{}, translate({0, 0, -.6}) * test::scale(.5), whole(builder), cloud(builder));
  expect_same_without_medium(std::move(builder), "surfaces");
}

TEST(LeaveOutInteriors, CubeSunkIntoAFloorKeepsItsExterior) {
  SceneBuilder builder = room();
  const MediumIndex chromatic = builder.homogeneous({1, 2, 4}, {.9, .5, .2});
  const MediumIndex thin = builder.homogeneous({.05, .05, .05}, {.9, .9, .9});
  builder
      .container(CubeShape{}, translate({0, 0, -.8}) * test::rotate_x(20) * test::scale(.5), whole(builder),
                 chromatic)
      .exterior = thin;
  builder.container(SphereShape{}, test::scale(20), builder.null(), thin);
  builder.scene.sensor.medium = thin;
  expect_same_without_medium(std::move(builder), "homogeneous grey media");
}

TEST(LeaveOutInteriors, BlackBackBesideGlassKeepsItsPixels) {
  SceneBuilder builder = room();
  builder.container(CubeShape{}, test::rotate_x(20) * test::scale(.5), builder.diffuse(.7), cloud(builder));
  builder.shape(CubeShape{}, test::rotate_x(20) * test::scale(.5), builder.glass(1.5));
  expect_same_without_medium(std::move(builder), "surfaces");
}

TEST(LeaveOutInteriors, OtherMediaKeepTheirPixels) {
  SceneBuilder builder = room();
  builder.container(SphereShape{}, translate({.8, 0, -.6}) * test::scale(.4), whole(builder), cloud(builder));
  add_fog(builder);
  expect_same_without_medium(std::move(builder), "homogeneous grey media");
}

TEST(LeaveOutInteriors, OverlappingMediaKeepTheirPixels) {
  SceneBuilder builder = room();
  builder.container(CubeShape{}, translate({.8, 0, -.6}) * test::scale(.3), whole(builder), cloud(builder));
  add_fog(builder);
  builder.container(SphereShape{}, translate({-.7, -.5, .2}) * test::scale(.5), builder.null(),
                    builder.homogeneous({2, 1, .5}, {.3, .3, .3}));
  const TileResult before = render(builder);
  builder.scene = scene::pruned(builder.scene, {}).scene;
  EXPECT_EQ(builder.scene.media.size(), 2u);
  EXPECT_EQ(render(builder).sums, before.sums);
}

// Pruning must keep this medium: without it the image changes.
TEST(LeaveOutInteriors, InteriorsOfGlassAreVisible) {
  SceneBuilder builder = room();
  Shape& ball = builder.container(SphereShape{}, test::scale(.5), builder.glass(1.5), cloud(builder));
  const TileResult before = render(builder);
  EXPECT_EQ(scene::pruned(builder.scene, {}).scene.media.size(), 1u);
  ball.interior.reset();
  EXPECT_NE(render(builder).sums, before.sums);
}

// A room of shapes of all kinds at random places and orientations, which may intersect. Media of several
// kinds are in them and around them, sometimes also around the camera.
SceneBuilder random_room(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto one_of = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const auto within = [&](double lo, double hi) { return lo + (hi - lo) * (random() % 1024) / 1023.; };
  SceneBuilder builder = room();
  const BsdfIndex grey = builder.diffuse(.7), glass = builder.glass(1.4);
  const BsdfIndex both = builder.bsdf(TwoSidedBsdf{grey, grey});
  const BsdfIndex half = builder.bsdf(
      BlendBsdf{builder.texture({.3, .3, .3}), grey,
                builder.bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, builder.texture({.8, .8, .8})})});
  const BsdfIndex bsdfs[] = {grey, both, both, builder.mirror(), half, glass, builder.null()};
  const ls::Geometry shapes[] = {SphereShape{}, CubeShape{},      SphereShape{},
                                 CubeShape{},   RectangleShape{}, CylinderShape{}};
  std::vector<MediumIndex> media;
  for (int i = 0; i < 5; ++i) {
    const double k = within(.1, 2);
    media.push_back(builder.homogeneous({k, k * (1 + one_of(2)), k}, {.8, .8, .8}, one_of(2) ? .5 : 0));
  }
  builder.set_emission(media.back(), {.2, .1, 0});
  for (int i = 0; i < 6; ++i) {
    const Transform place = translate({within(-1.5, 1.5), within(-1.5, 1.5), within(-1, 1)}) *
                            test::rotate_x(90. * one_of(4) + 7 * one_of(2)) * test::scale(within(.2, .8)) *
                            test::scale(one_of(4) ? 1 : -1, 1, 1);
    Shape& s = builder.container(shapes[one_of(6)], place, bsdfs[one_of(7)], media[one_of(5)]);
    s.flip_normals = one_of(5) == 0;
    if (one_of(3) == 0) s.exterior = media[one_of(2)];
    if (one_of(8) == 0) s.emitter = AreaEmitter{builder.texture({1, 2, 3})};
  }
  if (one_of(3) == 0) builder.scene.sensor.medium = media[one_of(5)];
  if (one_of(4) == 0) builder.scene.sensor.near_clip = within(1, 6);
  if (one_of(4) == 0) builder.look({within(-1, 1), within(-1, 1), within(-.5, 1)}, {0, 0, 0}, 60);
  return builder;
}

TEST(LeaveOutInteriors, RandomRoomsKeepTheirPixels) {
  int pruned = 0;
  for (std::uint32_t seed = 0; seed < 150; ++seed) {
    SceneBuilder builder = random_room(seed);
    builder.scene = scene::compacted(builder.scene);  // random numbers in media depend on their indices
    const Scene left = scene::pruned(builder.scene, {}).scene;
    EXPECT_EQ(scene::pruned(left, {}).scene, left) << seed;
    if (left.media.size() == builder.scene.media.size()) continue;
    ++pruned;
    const TileResult before = render(builder);
    builder.scene = left;
    EXPECT_EQ(render(builder).sums, before.sums) << seed;
  }
  EXPECT_GT(pruned, 20);
}

TEST(LeaveOutPhases, PurelyAbsorbingMediaKeepTheirPixels) {
  for (const bool overlapping : {false, true}) {
    SceneBuilder builder = room();
    add_fog(builder, 0, .7);
    const VolumeIndex v =
        builder.grid({2, 2, 2}, {0, 1, 2, 3, 4, 5, 6, 7}, translate({-1, -1, -1}) * test::scale(2));
    builder.container(CubeShape{}, translate({overlapping ? -.5 : .5, 0, 0}) * test::scale(.4),
                      builder.null(), builder.heterogeneous(v, {0, 0, 0}, 1, -.5));
    const TileResult before = render(builder);
    builder.scene = scene::pruned(builder.scene, {}).scene;
    EXPECT_EQ(builder.scene.phases.size(), 1u);
    EXPECT_EQ(render(builder).sums, before.sums);
  }
}

}  // namespace
}  // namespace ls::render
