// Splitting and roulette of paths, and roulette of shadow rays: which scenes use them. That the image stays
// the same is tested here for scenes in which paths meet several media or surfaces, and in
// techniques_test.cpp.
#include "worker/render/world/roulette.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/lit_cloud.h"
#include "tests/support/render_check.h"
#include "tests/support/significance.h"
#include "worker/render/world/pilot.h"

namespace ls::render {
namespace {

using test::scale;
using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr FrameSize kFrame{32, 16};

// A cloud in front of a sky; both are visible.
SceneBuilder cloud_in_the_sky() {
  SceneBuilder b = test::lit_cloud(kFrame);
  b.look({0, 0, 4}, {0, 0, 0}, 60, {0, 1, 0});
  return b;
}
SceneBuilder cloud_over_ground() {
  SceneBuilder b = cloud_in_the_sky();
  b.shape(RectangleShape{}, translate({0, -1.2, 0}) * test::rotate_x(-90) * scale(6), b.diffuse(.1));
  b.scene.integrator.rr_depth = 2;
  return b;
}
SceneBuilder without_splitting(SceneBuilder b) {
  b.scene.integrator.path_splitting = -1;
  return b;
}
void expect_same_image(const SceneBuilder& b, std::uint64_t spp) {
  ASSERT_TRUE(test::world_of(b)->paths_split);
  const auto with = test::half_images(b, spp), without = test::half_images(without_splitting(b), spp);
  const test::Estimate plain = test::estimate(without), change = test::difference(with, without);
  for (std::size_t k = 0; k < 3; ++k) {
    const double room =
        cli::student_quantile(test::kSingleFigure, change.freedom[k]) * change.standard_error[k];
    EXPECT_LT(std::abs(change.mean[k]), room) << k;
    EXPECT_LT(room, 2 * test::kBiasSeen * plain.mean[k]) << k << ": the test has no power";
  }
}

TEST(Splitting, RouletteComparesWithTheFirstVertex) {
  EXPECT_EQ(roulette_reference(.25f, 0, 1), .25f);
  EXPECT_EQ(roulette_reference(3, 0, 1), 1) << "paths that gain weight do not end sooner";
  EXPECT_EQ(roulette_reference(.25f, 4, 2), 2) << "twice the mean radiance was found";
  EXPECT_EQ(roulette_reference(.25f, .1f, 2), .25f);
  EXPECT_EQ(roulette_reference(.25f, 1e30f, 1e-30f), kBrightestReference);
  EXPECT_EQ(roulette_reference(1e-30f, 0, 1), kDarkestReference);
}

TEST(Splitting, IsTheSameForEverySeedAndCrop) {
  const SceneBuilder whole = cloud_in_the_sky();
  SceneBuilder crop = cloud_in_the_sky();
  crop.scene.film.crop_offset = {8, 4};
  crop.scene.film.crop_size = {5, 6};
  const auto world = test::world_of(whole);
  EXPECT_GT(world->mean_radiance, 0);
  EXPECT_TRUE(world->paths_split);
  for (const auto& other : {test::world_of(whole, 7), test::world_of(crop)}) {
    EXPECT_EQ(other->mean_radiance, world->mean_radiance);
    EXPECT_TRUE(other->paths_split);
  }
}

TEST(Splitting, IsLeftOutWhereItIsNotNeeded) {
  const auto world_with = [](auto&& change) {
    SceneBuilder b = cloud_in_the_sky();
    change(b.scene);
    return test::world_of(b);
  };
  const auto expect_none = [](const std::shared_ptr<const World>& w, const char* why) {
    EXPECT_EQ(w->mean_radiance, 0) << why;
    EXPECT_FALSE(w->paths_split) << why;
  };
  expect_none(world_with([](Scene& s) { s.integrator.path_splitting = -1; }), "switched off");
  expect_none(world_with([](Scene& s) { s.integrator.max_depth = 2; }), "light that is scattered once");
  expect_none(world_with([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }), "another integrator");
  SceneBuilder fog(kFrame);
  fog.container(CubeShape{}, {}, fog.null(), fog.homogeneous({1, 1, 1}, {.9, .9, .9}));
  fog.scene.emitters.push_back(DirectionalEmitter{{.3, -1, -.2}, {3, 3, 3}});
  expect_none(test::world_of(fog), "no grid");
  expect_none(test::world_of(test::lit_cloud({8, 8})), "fewer pixels than the measurement has paths for");
  expect_none(world_with([](Scene& s) { s.integrator.light_vertices = 1; }), "light vertices");
  // The camera is so close to the cloud that nothing else is visible
  SceneBuilder close = cloud_in_the_sky();
  close.look({0, 0, 1.2}, {0, 0, 0}, 30, {0, 1, 0});
  EXPECT_GT(test::world_of(close)->mean_radiance, 0);
  EXPECT_FALSE(test::world_of(close)->paths_split);
}

// A box of fog 2 units deep, or two of them in a row, covers the left half of the frame.
TEST(CameraCollisions, FollowTheOpticalDepth) {
  SceneBuilder b({32, 32});
  b.look({0, 0, 1000}, {0, 0, 0}, .1, {0, 1, 0});
  const MediumIndex fog = b.homogeneous({.3, .3, .3}, {.5, .5, .5});
  b.container(CubeShape{}, translate({-10, 0, 0}) * scale(10, 10, 1), b.null(), fog);
  const auto expect = [&](double depth) {
    const CameraCollisions c = camera_collisions(*test::world_of(b));
    // The rays at the corners deviate by 0.07 degrees from parallel rays. This increases optical depths by at
    // most 7e-7 of themselves, and probabilities by 3e-7; the rest is rounding
    EXPECT_NEAR(c.met, -std::expm1(-depth), 1e-6);
    EXPECT_NEAR(c.all, -std::expm1(-depth) / 2, 1e-6);
  };
  expect(.6);
  b.container(CubeShape{}, translate({-10, 0, -5}) * scale(10, 10, 1), b.null(), fog);
  expect(1.2);
  // A wall between the two boxes
  b.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), b.diffuse(.5));
  expect(.6);
}

TEST(Splitting, GivesTheSameImageOverDarkGround) { expect_same_image(cloud_over_ground(), 256); }

TEST(Splitting, GivesTheSameImageOfCloudsInFogAndOfOverlappingClouds) {
  SceneBuilder b = cloud_over_ground();
  const MediumIndex fog = b.homogeneous({.2, .3, .4}, {.9, .8, .7}, .3);
  b.container(CubeShape{}, translate({0, .2, 0}) * scale(.7), b.null(), fog);
  ASSERT_TRUE(test::world_of(b)->overlaps);
  expect_same_image(b, 256);
}

TEST(Splitting, GivesTheSameImageOfAnEmittingCloudWithColouredExtinction) {
  SceneBuilder b(kFrame);
  b.look({0, 0, 4}, {0, 0, 0}, 60, {0, 1, 0});
  std::vector<float> values;
  for (const float v : {1.f, .2f, .5f, 1.f, .3f, 1.f, 1.f, .4f})
    for (const float channel : {.5f, 1.f, .8f}) values.push_back(v * channel);
  const VolumeIndex grid = b.grid({2, 2, 2}, values, translate({-1, -1, -1}) * scale(2), 3);
  const MediumIndex cloud = b.heterogeneous(grid, {.9, .95, 1}, 3, .5);
  b.set_emission(cloud, {.3, .2, .1});
  b.container(CubeShape{}, scale(.99), b.null(), cloud);
  b.shape(RectangleShape{}, translate({0, -1.2, 0}) * test::rotate_x(-90) * scale(6), b.diffuse(.1));
  b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, -.2}, {3, 3, 3}});
  b.scene.integrator.max_depth = 6;
  b.scene.integrator.rr_depth = 2;
  b.scene.integrator.light_vertices = -1;
  ASSERT_TRUE(test::world_of(b)->need.chromatic && test::world_of(b)->need.emission);
  expect_same_image(b, 256);
}

void expect_same_bits(const World& w, std::size_t fewest_variants) {
  const auto names = covering_variants(w);
  EXPECT_GE(names.size(), fewest_variants);
  const PixelRect tile{0, 0, kFrame.width, kFrame.height};
  const TileResult first = render_tile(w, tile, {0, 8}, nullptr, nullptr);
  EXPECT_EQ(first.health.nonfinite + first.health.negative + first.health.majorant_violations, 0u);
  for (const std::string& name : names)
    EXPECT_EQ(render_tile_as(w, name, tile, {0, 8}).sums, first.sums) << name;
}

TEST(Splitting, AllVariantsSplitTheSame) {
  const auto world = test::world_of(cloud_over_ground());
  ASSERT_TRUE(world->paths_split);
  expect_same_bits(*world, 3);
}

TEST(Splitting, AllAimingVariantsSplitTheSame) {
  SceneBuilder b = cloud_over_ground();
  b.scene.emitters.push_back(PointEmitter{{.3, .2, .1}, {1, 1, 1}});
  const auto world = test::world_of(b);
  ASSERT_TRUE(world->paths_split && world->need.aimed);
  expect_same_bits(*world, 2);
}

// In both tests the two images are the same in each run. Their standard errors are those of sums over 512
// pixels; for normal distributions each would be accurate to 1 / sqrt(2 * 512) = 3 %.
double noise(const SceneBuilder& b) { return test::estimate(b, 64).standard_error[1]; }

TEST(Splitting, PathSplittingAloneReducesNoise) {
  SceneBuilder b = cloud_in_the_sky();
  b.scene.integrator.rr_depth = b.scene.integrator.max_depth;  // no roulette
  EXPECT_LT(noise(b), .9 * noise(without_splitting(b)));
}

TEST(Splitting, RouletteAloneReducesNoiseOnDarkGround) {
  SceneBuilder b = cloud_over_ground();
  b.look({0, -1, 4}, {0, -1.2, 2.5}, 30, {0, 1, 0});  // shows only ground, so no path splits
  EXPECT_LT(noise(b), .9 * noise(without_splitting(b)));
}

TEST(ShadowRoulette, TracesFaintShadowRaysLessOften) {
  EXPECT_EQ(shadow_ray_probability(2, 1), 1);
  EXPECT_EQ(shadow_ray_probability(1, 1), 1);
  EXPECT_EQ(shadow_ray_probability(.5f, 1), .5f);
  EXPECT_EQ(shadow_ray_probability(0, 1), kLeastTraced);
  EXPECT_EQ(shadow_ray_probability(0, 0), 1) << "no roulette";
}

// The renderer estimates the mean radiance by 512 paths. If their standard deviation is at most twice the
// mean, the standard error is at most 0.09 of it, and a factor of 2 is more than 5 standard errors away.
TEST(ShadowRoulette, MeasuresByTheMeanRadiance) {
  const SceneBuilder b = test::lit_cloud({128, 64});
  const auto mean = test::estimate(b, 4).mean;
  const double all = (mean[0] + mean[1] + mean[2]) / 3;
  const double faint = double{test::world_of(b)->faint_shadow};
  EXPECT_GT(faint, all / 2);
  EXPECT_LT(faint, all * 2);
}

TEST(ShadowRoulette, IsTheSameForEverySeedAndCrop) {
  const SceneBuilder whole = test::lit_cloud(kFrame);
  SceneBuilder crop = test::lit_cloud(kFrame);
  crop.scene.film.crop_offset = {8, 4};
  crop.scene.film.crop_size = {5, 6};
  const float faint = test::world_of(whole)->faint_shadow;
  EXPECT_GT(faint, 0);
  EXPECT_EQ(test::world_of(whole, 7)->faint_shadow, faint);
  EXPECT_EQ(test::world_of(crop)->faint_shadow, faint);
}

TEST(ShadowRoulette, IsLeftOutWhereItIsNotNeeded) {
  const auto faint = [](auto&& change) {
    SceneBuilder b = test::lit_cloud(kFrame);
    change(b.scene);
    return test::world_of(b)->faint_shadow;
  };
  EXPECT_EQ(faint([](Scene& s) { s.integrator.shadow_roulette = -1; }), 0);
  EXPECT_EQ(faint([](Scene& s) { s.emitters.pop_back(); }), 0) << "a sky of one radiance is not sampled";
  EXPECT_EQ(faint([](Scene& s) { s.integrator.max_depth = 1; }), 0) << "light that is not scattered";
  EXPECT_EQ(faint([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }), 0);
  SceneBuilder fog({32, 16});
  fog.container(CubeShape{}, {}, fog.null(), fog.homogeneous({1, 1, 1}, {.9, .9, .9}));
  fog.scene.emitters.push_back(DirectionalEmitter{{.3, -1, -.2}, {3, 3, 3}});
  EXPECT_EQ(test::world_of(fog)->faint_shadow, 0);
}

}  // namespace
}  // namespace ls::render
