// Second directions towards the sky: which scenes use them. That the image stays the same is tested in
// techniques_test.cpp.
#include "worker/render/world/aim.h"

#include <gtest/gtest.h>

#include "tests/support/render_check.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/pilot.h"
#include "worker/render/world/world_build.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

SceneBuilder yard() { return test::sky_yard({32, 16}); }

bool looks(const SceneBuilder& b) { return test::world_of(b)->sky_samples; }
template <class Change>
bool looks_with(Change change) {
  SceneBuilder b = yard();
  change(b);
  return looks(b);
}

TEST(SkySamples, AreTakenWhereTheSkyLightsTheScene) {
  EXPECT_TRUE(looks(yard()));
  EXPECT_FALSE(looks_with([](SceneBuilder& b) {
    std::get<ConstantEmitter>(b.scene.emitters.front()).radiance = {1e-5, 1e-5, 1e-5};
  })) << "the lamp is far brighter";
}

// The mean radiance of the pilot's paths of two segments, from which the decision is made.
double light_scattered_once(const SceneBuilder& b, std::uint64_t seed = 0) {
  RenderSettings settings = test::settings_of(b.scene);
  settings.seed = seed;
  const auto world = make_world(b.scene, settings, b.files, 1).value();
  return pilot_radiance(*world, 2).value();
}

TEST(SkySamples, AreTheSameForEverySeedAndCrop) {
  const double light = light_scattered_once(yard());
  EXPECT_GT(light, 0);
  EXPECT_EQ(light_scattered_once(yard(), 7), light);
  SceneBuilder crop = yard();
  crop.scene.film.crop_offset = {8, 4};
  crop.scene.film.crop_size = {5, 6};
  EXPECT_EQ(light_scattered_once(crop), light);
  EXPECT_TRUE(looks(crop));
}

TEST(SkySamples, AreLeftOutWhereTheyAreNotNeeded) {
  EXPECT_FALSE(looks_with([](SceneBuilder& b) { b.scene.integrator.sky_samples = -1; }));
  EXPECT_FALSE(looks_with([](SceneBuilder& b) { b.scene.emitters.clear(); })) << "no sky";
  EXPECT_FALSE(looks_with([](SceneBuilder& b) { b.scene.integrator.max_depth = 1; }))
      << "light that is not scattered";
  EXPECT_FALSE(looks_with([](SceneBuilder& b) { b.scene.integrator.name = "volpath_distant_mis"; }));
  EXPECT_FALSE(looks_with([](SceneBuilder& b) {
    b.container(SphereShape{{0, -1, 1}, .2}, {}, b.null(), b.homogeneous({1, 1, 1}, {.5, .5, .5}));
  })) << "fog";
  EXPECT_FALSE(looks(test::sky_yard({8, 8}))) << "fewer pixels than the measurement has paths for";
}

TEST(SkySamples, ReduceNoise) {
  SceneBuilder without = yard();
  without.scene.integrator.sky_samples = -1;
  const auto noise = [](const SceneBuilder& b) {
    const auto e = test::estimate(b, 32);
    return e.standard_error[1];
  };
  // The two images are the same in each run. Each standard error is that of a sum over 512 pixels, so it is
  // accurate to about 1 / sqrt(2 * 512) = 3 %. A second direction removes a sixth of the noise.
  EXPECT_LT(noise(yard()), .95 * noise(without));
}

}  // namespace
}  // namespace ls::render
