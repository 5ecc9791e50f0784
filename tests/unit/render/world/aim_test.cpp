// Additional points on segments, directions near lamps and directions towards the sky (aim.h): which scenes
// use them, and that they reduce noise. That the image stays the same is tested in techniques_test.cpp,
// tests/statistical and tests/property.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/render_check.h"
#include "tests/support/sky_yard.h"
#include "worker/render/world/aim.h"
#include "worker/render/world/pilot.h"
#include "worker/render/world/world_build.h"

namespace ls::render {
namespace {

using test::scale;
using test::SceneBuilder;
using test::translate;
using test::operator*;
using ::testing::Contains;
using ::testing::HasSubstr;

const char* const kPoints = "points on camera segments at which light is sampled";
const char* const kNearLamps = "directions near lights without extent";

// The camera looks through a box of fog, 2 units deep, at a floor behind it.
SceneBuilder fog(double sigma_t, bool grid = false, double floor = .5) {
  SceneBuilder builder({24, 16});
  builder.look({0, 0, 4}, {0, 0, 0}, 30, {0, 1, 0});
  builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(4), builder.diffuse(floor));
  const Rgb sigma{sigma_t, sigma_t, sigma_t}, albedo{.9, .8, .7};
  const MediumIndex medium = grid ? builder.heterogeneous(builder.grid({2, 2, 2}, {1, 1, 1, 1, 1, 1, 1, 1},
                                                                       translate({-1, -1, -1}) * scale(2)),
                                                          albedo, sigma_t)
                                  : builder.homogeneous(sigma, albedo, .3);
  builder.container(CubeShape{}, {}, builder.null(), medium);
  builder.scene.integrator.max_depth = 6;
  return builder;
}
void add_sun(SceneBuilder& builder) {
  builder.scene.emitters.push_back(DirectionalEmitter{{0, -1, -.2}, {3, 3, 3}});
}
void add_lamp(SceneBuilder& builder) {
  builder.scene.emitters.push_back(PointEmitter{{.3, .2, .1}, {1, 1, 1}});
}
WorldReport report(const SceneBuilder& builder) { return describe(*test::world_of(builder)); }

TEST(Aim, LooksForDistantLightAlongCameraSegmentsThroughThinMedia) {
  for (const bool grid : {false, true}) {
    SceneBuilder thin = fog(.1, grid), dense = fog(1, grid);
    add_sun(thin);
    add_sun(dense);
    EXPECT_THAT(report(thin).used, Contains(kPoints)) << grid;
    EXPECT_THAT(report(thin).left_out, Contains(kNearLamps)) << grid;
    EXPECT_THAT(report(thin).variant, HasSubstr("aimed")) << grid;
    EXPECT_THAT(report(dense).left_out, Contains(kPoints)) << grid;
    EXPECT_THAT(report(dense).variant, Not(HasSubstr("aimed"))) << grid;
  }
}

TEST(Aim, AimsDirectionsAtLampsInMedia) {
  for (const bool grid : {false, true}) {
    SceneBuilder builder = fog(.2, grid);
    add_lamp(builder);
    EXPECT_THAT(report(builder).used, Contains(kNearLamps)) << grid;
    EXPECT_THAT(report(builder).left_out, Contains(kPoints)) << grid;
  }
}

TEST(Aim, LeavesOutWhatASceneDoesNotNeed) {
  SceneBuilder area = fog(.1);
  area.lamp(RectangleShape{}, translate({0, 2, 0}));
  SceneBuilder no_medium({24, 16});
  add_sun(no_medium);
  add_lamp(no_medium);
  SceneBuilder only_seen = fog(.1);
  add_sun(only_seen);
  only_seen.scene.integrator.max_depth = 1;
  SceneBuilder switched_off = fog(.1);
  add_sun(switched_off);
  add_lamp(switched_off);
  SceneBuilder distant = switched_off;
  switched_off.scene.integrator.camera_points = -1;
  switched_off.scene.integrator.phase_only = true;
  distant.scene.integrator.name = "volpath_distant_mis";
  for (const SceneBuilder& builder : {area, no_medium, only_seen, switched_off, distant})
    EXPECT_THAT(report(builder).variant, Not(HasSubstr("aimed")));
}

// A crop must have the pixels of the full frame, so the decision must not depend on the crop.
TEST(Aim, CropMakesTheSameChoiceAsTheWholeFrame) {
  SceneBuilder whole = fog(.1);
  add_sun(whole);
  SceneBuilder crop = whole;
  crop.scene.film.crop_offset = {0, 0};
  crop.scene.film.crop_size = {4, 4};  // shows hardly any fog
  const auto a = render_tile(*test::world_of(whole), {0, 0, 4, 4}, {0, 8}, nullptr, nullptr);
  const auto b = render_tile(*test::world_of(crop), {0, 0, 4, 4}, {0, 8}, nullptr, nullptr);
  EXPECT_EQ(a.sums, b.sums);
}

double squared_error(const SceneBuilder& builder) {
  const auto estimate = test::estimate(builder, 2);
  return estimate.standard_error[1] * estimate.standard_error[1];
}

// With an optical depth of 0.2 a share p = 0.18 of the flights ends in the fog, and only these find the light
// that is scattered there: the variance of a sample is (1 - p) / p = 4.5 times the square of its mean. With
// points on the segment only the sun's transmittance through the fog varies, between 1 and exp(-0.2), so the
// variance is below 0.01 times that square.
TEST(Aim, ReducesNoiseOfLightScatteredOnceInThinFog) {
  for (const bool grid : {false, true}) {
    SceneBuilder points = fog(.1, grid, 0);
    add_sun(points);
    points.scene.integrator.max_depth = 2;
    points.scene.film.size = {32, 32};
    points.look({0, 0, 4}, {0, 0, 0}, 10, {0, 1, 0});
    SceneBuilder none = points;
    points.scene.integrator.camera_points = 4;
    none.scene.integrator.camera_points = -1;
    EXPECT_LT(squared_error(points), .01 * squared_error(none)) << grid;
  }
}

SceneBuilder yard() { return test::sky_yard({32, 16}); }

bool looks(const SceneBuilder& b) { return test::world_of(b)->sky_samples; }
template <class Change>
bool looks_with(Change change) {
  SceneBuilder b = yard();
  change(b);
  return looks(b);
}

TEST(SkySamples, AreUsedIfTheSkyLightsTheScene) {
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
