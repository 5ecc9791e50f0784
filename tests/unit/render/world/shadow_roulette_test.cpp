// Which shadow rays are traced at random. That the image stays the same is tested in techniques_test.cpp.
#include "worker/render/world/roulette.h"

#include <gtest/gtest.h>

#include "tests/support/lit_cloud.h"
#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

constexpr FrameSize kSize{32, 16};

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
  const SceneBuilder whole = test::lit_cloud(kSize);
  SceneBuilder crop = test::lit_cloud(kSize);
  crop.scene.film.crop_offset = {8, 4};
  crop.scene.film.crop_size = {5, 6};
  const float faint = test::world_of(whole)->faint_shadow;
  EXPECT_GT(faint, 0);
  EXPECT_EQ(test::world_of(whole, 7)->faint_shadow, faint);
  EXPECT_EQ(test::world_of(crop)->faint_shadow, faint);
}

TEST(ShadowRoulette, IsLeftOutWhereItIsNotNeeded) {
  const auto faint = [](auto&& change) {
    SceneBuilder b = test::lit_cloud(kSize);
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
