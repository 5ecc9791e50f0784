// Next-event estimation towards emissive grids: which scenes use it, how much noise it removes, and that it
// does not depend on the seed, the crop or the threads. That the image stays the same is tested in
// tests/property/emissive_grids_test.cpp.
#include "worker/render/lights/emissive_grids.h"

#include <gtest/gtest.h>

#include "tests/support/fire.h"
#include "tests/support/render_check.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::Fire;
using test::SceneBuilder;

SceneBuilder fire(int emissive_grids = 0, FrameSize size = {24, 16}) {
  return Fire{.emissive_grids = emissive_grids}.builder(size);
}
bool is_used(const SceneBuilder& b) { return test::world_of(b)->emissive.any(); }

TEST(EmissiveGrids, AreLookedForWhereTheFireIsSmall) {
  EXPECT_TRUE(is_used(fire()));
  EXPECT_FALSE(is_used(fire(-1)));
}

TEST(EmissiveGrids, AreNotLookedForByOtherIntegrators) {
  for (const char* name : {"path", "volpath_distant_mis"}) {
    SceneBuilder b = fire(1);
    b.scene.integrator.name = name;
    EXPECT_FALSE(is_used(b)) << name;
  }
}

// Where fog falls with height, its light is in proportion to its density, without an end and without cells.
TEST(EmissiveGrids, AreNotFogThatFallsWithHeight) {
  const auto is_used_in = [](bool falls) {
    SceneBuilder b = Fire{.absorbed = true, .emissive_grids = 1}.builder({24, 16});
    auto& flame = std::get<HeterogeneousMedium>(b.scene.media.at(0));
    flame.source_radiance = SceneBuilder::push<VolumeTag>(b.scene.volumes, ConstVolume{{1, 1, 1}, {}});
    if (falls) flame.sigma_t = SceneBuilder::push<VolumeTag>(b.scene.volumes, HeightFogVolume{});
    return is_used(b);
  };
  EXPECT_TRUE(is_used_in(false));
  EXPECT_FALSE(is_used_in(true));
}

// The camera is in a glowing cloud that fills the scene and hides all else: paths meet its light anyway. What
// was learned leaves the image unchanged.
TEST(EmissiveGrids, AreNotLookedForWhereThatDoesNotPay) {
  const auto cloud = [](int emissive_grids) {
    SceneBuilder b({24, 16});
    b.look({0, 0, .1}, {0, 0, 0}, 60, {0, 1, 0});
    const Transform place = test::translate({-1, -1, -1}) * test::scale(2);
    const MediumIndex m =
        b.heterogeneous(b.grid({2, 2, 2}, std::vector<float>(8, 1), place), {.5, .5, .5}, 4);
    std::get<HeterogeneousMedium>(b.scene.media[m.value]).emission =
        b.grid({2, 2, 2}, {1, 2, 1, 2, 2, 1, 2, 1}, place);
    b.container(CubeShape{}, test::scale(.99), b.null(), m);
    b.scene.sensor.medium = m;
    b.scene.integrator.emissive_grids = emissive_grids;
    return b;
  };
  EXPECT_TRUE(is_used(cloud(1)));
  EXPECT_FALSE(is_used(cloud(0)));
  const auto sums = [](const SceneBuilder& b) {
    return render_tile(*test::world_of(b, 3), {0, 0, 16, 16}, {0, 4}, nullptr, nullptr).sums;
  };
  EXPECT_EQ(sums(cloud(0)), sums(cloud(-1)));
  EXPECT_NE(sums(cloud(1)), sums(cloud(-1)));
}

TEST(EmissiveGrids, AreTheSameForAnyNumberOfThreadsAndForEveryCrop) {
  const auto sums = [](SceneBuilder b, int threads, PixelRect tile) {
    const auto world = test::world_of(b, 3, threads);
    EXPECT_TRUE(world->emissive.any());
    return render_tile(*world, tile, {0, 4}, nullptr, nullptr).sums;
  };
  const SceneBuilder whole = fire(0, {64, 64});
  const auto one = sums(whole, 1, {16, 16, 24, 24});
  for (const int threads : {2, 5}) EXPECT_EQ(sums(whole, threads, {16, 16, 24, 24}), one) << threads;
  SceneBuilder crop = whole;
  crop.scene.film.crop_offset = {16, 16};
  crop.scene.film.crop_size = {8, 8};
  EXPECT_EQ(sums(crop, 1, {0, 0, 8, 8}), one);
}

// A cube without extinction, of side 1 and emission 1 per length, lights a white plate 100 away, which faces
// it: its irradiance is the integral of emission times cosine over squared distance, which is the cube's
// volume over 100^2 up to terms of (1 / 100)^2.
TEST(EmissiveGrids, DistantCubeLightsAPlate) {
  constexpr double kDistance = 100;
  SceneBuilder b({16, 16});
  b.look({0, 0, 3}, {0, 0, 0}, 20, {0, 1, 0});
  b.shape(RectangleShape{}, test::scale(5), b.diffuse(1));
  const Transform place = test::translate({-.5, -.5, kDistance - .5});
  const MediumIndex m = b.heterogeneous(b.grid({2, 2, 2}, std::vector<float>(8, 0), place), {0, 0, 0});
  std::get<HeterogeneousMedium>(b.scene.media[m.value]).emission =
      b.grid({2, 2, 2}, std::vector<float>(8, 1), place);
  b.container(CubeShape{}, test::translate({0, 0, kDistance}) * test::scale(.5), b.null(), m);
  b.scene.integrator.emissive_grids = 1;
  b.scene.integrator.max_depth = 2;

  const auto plate = test::estimate(b, 256);

  const double expected = 1 / (kDistance * kDistance) / kPiD;
  for (std::size_t c = 0; c < 3; ++c) {
    const double tolerance =
        cli::student_quantile(test::kSingleFigure, plate.freedom[c]) * plate.standard_error[c] / expected;
    EXPECT_LT(tolerance, test::kBiasSeen) << "the test has no power";
    EXPECT_NEAR(plate.mean[c] / expected, 1, tolerance + 4 / (kDistance * kDistance));
  }
}

TEST(EmissiveGrids, ReduceNoise) {
  const auto noise = [](int emissive_grids) {
    return test::estimate(fire(emissive_grids, {24, 24}), 32).standard_error[1];
  };
  // The two images are the same in each run. Each standard error is that of a sum over 576 pixels, so it is
  // accurate to about 1 / sqrt(2 * 576) = 3 %, and less if few bright pixels dominate.
  EXPECT_LT(noise(0), .5 * noise(-1));
}

}  // namespace
}  // namespace ls::render
