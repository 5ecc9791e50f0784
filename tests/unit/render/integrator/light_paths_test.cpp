// Tests which scenes connect paths to light vertices, that connections reduce noise, and that they do not
// depend on threads or variants. tests/property/connections_test.cpp tests that they do not change the image.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/render_check.h"
#include "tests/support/sunny_room.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/integrator/light_paths.h"
#include "worker/render/lights/light_vertices.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::SunnyRoom;
using test::operator*;
using testing::HasSubstr;

std::string variant(const SceneBuilder& b) { return describe(*test::world_of(b)).variant; }
bool connects(const SceneBuilder& b) { return variant(b).find("connected") != std::string::npos; }

TEST(LightPaths, ConnectWhereTheSunIsRarelyFound) {
  EXPECT_TRUE(connects(SunnyRoom{}.builder()));
  EXPECT_TRUE(connects(SunnyRoom{.glossy = true, .fog = .3, .grid = true}.builder()));
  SceneBuilder open({16, 16});  // two walls in full sun
  open.look({0, 3, 3}, {0, 0, 0}, 40, {0, 1, 0});
  open.shape(RectangleShape{}, test::rotate_x(-90), open.diffuse(.8));
  open.shape(RectangleShape{}, test::translate({0, 1, -1}), open.diffuse(.8));
  open.scene.emitters.push_back(DirectionalEmitter{{0, -1, -1}, {1, 1, 1}});
  EXPECT_FALSE(connects(open));
}

TEST(LightPaths, LeaveOutWhatASceneDoesNotNeed) {
  const auto changed = [](auto&& change, SunnyRoom room = {}) {
    SceneBuilder b = room.builder();
    change(b.scene);
    return b;
  };
  const auto depth = [](int max) { return [max](Scene& s) { s.integrator.max_depth = max; }; };
  EXPECT_TRUE(connects(changed(depth(3))));
  EXPECT_FALSE(connects(changed(depth(2)))) << "direct light alone";
  EXPECT_FALSE(connects(SunnyRoom{.light_vertices = -1}.builder()));
  EXPECT_FALSE(connects(changed([](Scene& s) { s.emitters.clear(); })));
  EXPECT_FALSE(connects(changed([](Scene& s) {
    std::get<DirectionalEmitter>(s.emitters[0]).angular_radius = 1;
  }))) << "a sun with an extent can be hit";
  EXPECT_FALSE(connects(changed([](Scene& s) { s.integrator.name = "volpath_distant_mis"; }, {.fog = .3})));
  for (const bool sheet : {false, true})
    for (const int max_depth : {-1, 5})
      EXPECT_EQ(
          connects(changed([](Scene& s) { s.integrator.name = "path"; },
                           {.glossy = true, .sheet = sheet, .light_vertices = 1, .max_depth = max_depth})),
          !sheet || max_depth < 0)
          << "in `path`, sheets passed count for max_depth";
}

// The image does not depend on the number of threads that learn.
TEST(LightPaths, AreTheSameForAnyNumberOfThreads) {
  const auto sums = [](int threads) {
    const auto world = test::world_of(SunnyRoom{.glossy = true, .fog = .3}.builder({128, 128}), 3, threads);
    EXPECT_TRUE(world->need.connected);
    return render_tile(*world, {0, 0, 16, 16}, {0, 4}, nullptr, nullptr).sums;
  };
  const auto one = sums(1);
  for (const int threads : {2, 5}) EXPECT_EQ(sums(threads), one) << threads;
}

// Rays of the sun start in a vacuum and pass the media that the boundaries on their way declare. If camera
// paths find other media there, the scene does not connect paths.
TEST(LightPaths, AreUnusedIfMediaDependOnTheDirection) {
  const SunnyRoom room{.light_vertices = 1};
  SceneBuilder fog_everywhere = room.builder();  // the fog also fills the space outside the room
  fog_everywhere.scene.sensor.medium = fog_everywhere.homogeneous({.1, .1, .1}, {.9, .9, .9});
  EXPECT_FALSE(connects(fog_everywhere));
  SceneBuilder fog_around = room.builder();  // at first the camera declares to be in no medium
  fog_around.container(CubeShape{}, test::scale(3), fog_around.null(),
                       fog_around.homogeneous({.1, .1, .1}, {.9, .9, .9}));
  EXPECT_FALSE(connects(fog_around));
  fog_around.scene.sensor.medium = MediumIndex{0};
  EXPECT_TRUE(connects(fog_around));
  SceneBuilder open = room.builder();  // fog behind a sheet in the slit
  open.container(RectangleShape{}, test::translate({.9, .25, 0}) * test::rotate_y(90), open.null(),
                 open.homogeneous({.1, .1, .1}, {.9, .9, .9}));
  EXPECT_FALSE(connects(open));
}

// The slit of the room is closed, so paths find no sun. Then the settings cannot enforce connections.
TEST(LightPaths, AreUnusedWithoutASun) {
  SceneBuilder dark = SunnyRoom{.light_vertices = 1}.builder();
  dark.shape(RectangleShape{}, test::translate({1.1, 0, 0}) * test::rotate_y(90) * test::scale(2),
             dark.diffuse(0));
  EXPECT_FALSE(connects(dark));
}

// The test prints the ratios of the squared errors: 0.15 without fog and 0.25 with it. The limit of one half
// leaves room for other sequences of random numbers.
TEST(LightPaths, ReduceNoiseOfIndirectLight) {
  for (const double fog : {0., .5}) {
    const auto squared_error = [&](int light_vertices) {
      const auto e =
          test::estimate(SunnyRoom{.fog = fog, .light_vertices = light_vertices}.builder({32, 32}), 16);
      return e.standard_error[1] * e.standard_error[1];
    };
    const double with = squared_error(1), without = squared_error(-1);
    std::printf("fog %g: %.3f\n", fog, with / without);
    EXPECT_LT(with, .5 * without) << fog;
  }
}

// The estimate (look) of a glossy light vertex must not be much too dark where the surface is bright: the
// vertex would be chosen too rarely, with too much weight. At an angle t from the mirrored direction a narrow
// Beckmann lobe has the share exp(-x) of its peak, x = t^2 / (4 alpha^2), and the Henyey-Greenstein lobe of
// the same peak and integral has (1 + 2 x)^-1.5. So the look is at most 3^1.5 / e = 1.91 times too dark, at x
// = 1. For wide lobes, some of which the even part describes alone, the test finds up to 2.54.
TEST(LightPaths, SeeHowBrightGlossySurfacesAre) {
  for (const double alpha : {.03, .1, .15, .3, .6}) {
    SceneBuilder b({4, 4});
    b.look({0, 0, 3}, {0, 0, 0}, 40, {0, 1, 0});
    RoughConductorBsdf metal;
    metal.alpha_u = metal.alpha_v = b.texture({alpha, alpha, alpha});
    metal.eta = {.4, .5, 1};
    metal.k = {3.7, 2.8, 1.8};
    metal.specular_reflectance = b.texture({1, 1, 1});
    b.shape(RectangleShape{}, {}, b.bsdf(metal));
    b.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
    b.scene.integrator.light_vertices = 1;
    const auto world = test::world_of(b);
    for (const float sine : {0.f, .3f, .7f, .95f}) {
      LightVertex y;
      const V3 o(.1f, .2f, 1), down(0, 0, -1);
      const auto primitive = world->accel.nearest(o, down, kInfinity);
      ASSERT_TRUE(primitive && world->geometry.complete(*primitive, o, down, y.hit));
      y.light = C3(1);
      y.to_light = {sine, 0, std::sqrt(1 - sine * sine)};
      y.densities = {1, 0};
      const auto look = look_of(*world, y);
      const BsdfIndex bsdf = world->geometry.surfaces[y.hit.surface].bsdf;
      const V3 to_light = y.hit.shading.to_local(y.to_light);
      struct Seen {
        float light, look;
      };
      std::vector<Seen> seen;
      float peak = 0;
      RandomStream random(3);
      for (int i = 0; i < 4000; ++i) {
        const auto s = world->bsdfs.sample(bsdf, y.hit.uv_point(), to_light, random.uniform(),
                                           {random.uniform(), random.uniform()});
        if (!s || s->wi.z < .05f) continue;
        const float light = (s->weight.x + s->weight.y + s->weight.z) / 3 * s->pdf * to_light.z / s->wi.z;
        const float cosine = -dot(y.hit.shading.to_world(s->wi), look.axis);
        const float lobe = (1 - look.g * look.g) / std::pow(1 + look.g * look.g - 2 * look.g * cosine, 1.5f);
        seen.push_back({light * s->wi.z, look.even * s->wi.z + look.lobe * lobe});
        peak = std::max(peak, seen.back().light);
      }
      float worst = 0;
      for (const Seen& s : seen)
        if (s.light > .1f * peak) worst = std::max(worst, s.light / s.look);
      EXPECT_GT(worst, 0);
      EXPECT_LT(worst, alpha < .2 ? 1.95 : 2.6) << alpha << " " << sine;
    }
  }
}

TEST(LightPaths, GiveTheSameSumsForAnyDivisionOfSamples) {
  constexpr std::uint64_t kAt = LightVertexCache::kEpoch;
  const auto world = test::world_of(SunnyRoom{.fog = .3, .light_vertices = 1}.builder());
  const PixelRect tile{3, 2, 7, 5};
  const auto whole = render_tile(*world, tile, {kAt - 4, kAt + 4}, nullptr, nullptr);
  const auto again = render_tile(*test::world_of(SunnyRoom{.fog = .3, .light_vertices = 1}.builder()), tile,
                                 {kAt - 4, kAt + 4}, nullptr, nullptr);
  EXPECT_EQ(whole.sums, again.sums);
  std::vector<float> one_by_one(whole.sums.size(), 0.f);
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const auto one = render_tile(*world, {x, y, x + 1, y + 1}, {kAt - 4, kAt + 4}, nullptr, nullptr);
      const auto i = static_cast<std::size_t>((y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0);
      for (std::size_t p = 0; p < one.sums.size(); ++p)
        one_by_one[p * static_cast<std::size_t>(tile.pixels()) + i] = one.sums[p];
    }
  EXPECT_EQ(whole.sums, one_by_one);
  double sum = 0;
  for (std::uint64_t s = kAt - 4; s < kAt + 4; s += 2) sum += render_sample(*world, 3, 2, s).rgb[1];
  EXPECT_FLOAT_EQ(static_cast<float>(sum), whole.sums[static_cast<std::size_t>(tile.pixels())]);
}

// In deep white fog light is scattered a hundred times and more before it leaves.
TEST(LightPaths, AreBoundedWithoutAbsorption) {
  SceneBuilder room = SunnyRoom{.fog = 100, .light_vertices = 1, .max_depth = -1}.builder();
  for (auto& medium : room.scene.media) std::get<HomogeneousMedium>(medium).albedo = {1, 1, 1};
  const auto world = test::world_of(room);
  ASSERT_TRUE(connects(room));
  const std::size_t count = trace_light_vertices(*world, 0).count();
  EXPECT_GT(count, 4u << 14) << "the test would say nothing";
  EXPECT_LT(count, 10u << 14) << "ten for each of the 2^14 rays";
}

TEST(LightPaths, CropUsesThoseOfTheWholeFrame) {
  SceneBuilder whole = SunnyRoom{}.builder(), crop = whole;
  crop.scene.film.crop_offset = {12, 12};
  crop.scene.film.crop_size = {4, 4};
  const auto a = render_tile(*test::world_of(whole), {12, 12, 16, 16}, {0, 8}, nullptr, nullptr);
  const auto b = render_tile(*test::world_of(crop), {0, 0, 4, 4}, {0, 8}, nullptr, nullptr);
  EXPECT_EQ(a.sums, b.sums);
}

// All variants that have the features of a scene render it to the same bits.
TEST(LightPaths, GiveTheSameBitsByEveryVariant) {
  const auto world = test::world_of(SunnyRoom{.light_vertices = 1}.builder());
  const auto expected = render_tile(*world, {0, 0, 8, 8}, {0, 4}, nullptr, nullptr).sums;
  const auto names = covering_variants(*world);
  EXPECT_GE(names.size(), 4u);
  for (const std::string& name : names) {
    auto sums = render_tile_as(*world, name, {0, 0, 8, 8}, {0, 4}).sums;
    sums.resize(expected.size());
    EXPECT_EQ(sums, expected) << name;
  }
}

#ifdef LIGHTSHAFT_COUNT

// 2,000 index-matched panes stand between the camera and a floor in the sun, in thin fog.
TEST(LightPaths, LearningIsSkippedWherePathsPassThousandsOfBoundaries) {
  constexpr int kPanes = 2000;
  SceneBuilder b({8, 8});
  b.look({0, 0, 4}, {0, 0, 0}, 20, {0, 1, 0});
  b.container(CubeShape{}, test::scale(9), b.null(), b.homogeneous({.001, .001, .001}, {.9, .9, .9}));
  b.shape(RectangleShape{}, test::scale(5), b.diffuse(.5));
  for (int i = 0; i < kPanes; ++i)
    b.shape(RectangleShape{}, test::translate({0, 0, 1 + .001 * i}) * test::scale(5), b.null());
  b.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, {1, 1, 1}});
  b.scene.integrator.light_vertices = 1;
  b.scene.integrator.path_reuse = b.scene.integrator.camera_points = -1;
  work_counters() = {};

  test::world_of(b);

  // A path passes the panes twice, down and up, and its shadow ray passes them once. So a third of the limit
  // of 2^20 rays and boundaries is used by shadow rays. Without the limit, all 1,024 paths would use 2
  // million for shadow rays.
  EXPECT_GT(work_counters().boundary_rays, 300'000u);
  EXPECT_LT(work_counters().boundary_rays, 400'000u);
}

#endif

}  // namespace
}  // namespace ls::render
