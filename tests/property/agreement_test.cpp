// Integrators that claim a scene give the same image: those of random scenes that someone could have meant
// are compared in means over parts of the frame. Two stages: where a first look is suspicious, a second with
// fresh numbers and 16 times as many decides, at a level that keeps a right renderer from failing anywhere in
// the whole run with more than this file's share of the suite's rate. The seeds are fixed.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/property/compare.h"
#include "tests/property/random_scene.h"
#include "tests/property/watch.h"
#include "tests/support/sunny_room.h"

namespace ls::test {
namespace {

constexpr std::uint64_t kScenes = 60;
// of a usual run
struct Rival {
  const char* name;
  IntegratorSettings settings;
};

// What is compared with `volpath`, all with its depths.
std::vector<Rival> rivals(const IntegratorSettings& base) {
  std::vector<Rival> all;
  const auto add = [&](const char* name, DistanceSampling d, MisHeuristic h) {
    IntegratorSettings s = base;
    s.name = "volpath_distant_mis";
    s.distance = d;
    s.heuristic = h;
    all.push_back({name, s});
  };
  add("mis, power", DistanceSampling::mis, MisHeuristic::power);
  add("mis, balance", DistanceSampling::mis, MisHeuristic::balance);
  add("exponential", DistanceSampling::exponential, MisHeuristic::power);
  add("equiangular", DistanceSampling::equiangular, MisHeuristic::balance);
  IntegratorSettings s = base;
  s.camera_points = -1;
  s.phase_only = true;
  all.push_back({"without points and lamps", s});
  s.camera_points = 3;
  s.phase_only = false;
  all.push_back({"three points", s});
  return all;
}

SceneBuilder quarter(const RandomScene& s, const IntegratorSettings& integrator, int which) {
  SceneBuilder builder;
  builder.scene = s.scene;
  builder.files = s.assets.files();
  builder.scene.integrator = integrator;
  builder.scene.film.size = {16, 16};
  builder.scene.film.crop_offset = {8 * (which & 1), 8 * (which >> 1)};
  builder.scene.film.crop_size = {8, 8};
  return builder;
}

TEST(RandomScenes, GiveTheSameImageByEveryIntegrator) {
  const auto [first, count] = scenes_to_try(kScenes);
  // Three channels, one quarter of the frame and one rival for a scene.
  Tests tests("property/agreement");
  std::uint64_t with_media = 0, undecided = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    RandomScene s = random_scene(seed, {.wild = 0, .calm = true});
    const Watch watch(told(s));
    IntegratorSettings base = s.scene.integrator;
    base.name = "volpath";
    base.path_reuse = -1;  // pixels err independently
    s.scene.integrator = base;
    const auto world = render::build_world(s.scene, settings_of(s.scene), s.assets.files(), 1);
    if (!world) continue;
    const int part = static_cast<int>(seed % 4);

    const std::string cheapest = render::covering_variants(**world).front();
    if (cheapest.starts_with("surfaces")) {
      // Nothing for them to differ in: the same bits. But where light passes surfaces, `path` counts each as
      // a segment of its maximum depth.
      if (cheapest != "surfaces" && base.max_depth >= 0) continue;
      IntegratorSettings path = base;
      path.name = "path";
      const Estimate a = estimate(quarter(s, base, part), 4), b = estimate(quarter(s, path, part), 4);
      EXPECT_EQ(a.mean, b.mean) << told(s);
      continue;
    }
    ++with_media;
    const auto all = rivals(base);
    const Rival& rival = all[(seed / 4) % all.size()];
    const Comparison c =
        look(quarter(s, base, part), quarter(s, rival.settings, part), 10 * seed, tests.level(3));
    undecided += c.verdict == Verdict::undecided;
    if (c.verdict == Verdict::different)
      ADD_FAILURE() << "volpath and " << rival.name << " differ in quarter " << part << "\n"
                    << c.told << told(s);
  }
  fmt::print("{} scenes, {} with media, {} of them undecided\n", count, with_media, undecided);
  if (count == kScenes) tests.close();
  EXPECT_GE(4 * with_media, count);
  EXPECT_LE(10 * undecided, with_media + 10);
}

// A narrow beam in fog above a floor, and a second lamp: what is scattered several times near the lamps.
SceneBuilder lamps_in_fog(bool grid) {
  SceneBuilder builder({16, 16});
  builder.scene.integrator.max_depth = 8;
  builder.look({0, 0, 5}, {0, 0, 0}, 40, {0, 1, 0});
  builder.shape(RectangleShape{}, translate({0, -1.2, 0}) * rotate_x(-90) * scale(3), builder.diffuse(.7));
  const MediumIndex fog =
      grid ? builder.heterogeneous(builder.grid({3, 3, 3}, {1, 2, 3, 1, 0, 2, 2, 1, 3, 3, 2, 1, 0, 1,
                                                            2, 1, 2, 3, 2, 0, 1, 1, 3, 2, 1, 2, 0},
                                                translate({-1, -1, -1}) * scale(2)),
                                   {.9, .8, .7}, .4, .3)
           : builder.homogeneous({.4, .5, .6}, {.95, .9, .8}, .5);
  builder.container(CubeShape{}, {}, builder.null(), fog);
  SpotEmitter spot;
  spot.intensity = {30, 28, 24};
  spot.cutoff_angle = 25;
  spot.beam_width = 15;
  spot.to_world = translate({-.3, .6, .1}) * rotate_x(80);
  builder.scene.emitters.push_back(spot);
  builder.scene.emitters.push_back(PointEmitter{{.5, -.2, -.3}, {1, 2, 3}});
  builder.environment(.1);
  return builder;
}

TEST(Lamps, GiveTheSameImageWithAndWithoutAimedDirections) {
  Tests tests("property/lamps");
  for (const bool grid : {false, true}) {
    SceneBuilder aimed = lamps_in_fog(grid), plain = aimed;
    plain.scene.integrator.phase_only = true;
    plain.scene.integrator.camera_points = -1;
    ASSERT_THAT(render::describe(*world_of(aimed)).variant, testing::HasSubstr("aimed"));
    ASSERT_THAT(render::describe(*world_of(plain)).variant, testing::Not(testing::HasSubstr("aimed")));
    // Without the aim a second moment is infinite, so the plain image gets no closer than this
    const Comparison c = look(aimed, plain, 31 + grid, tests.level(3), {1024, 16384});
    EXPECT_NE(c.verdict, Verdict::different) << c.told;
  }
  tests.close();
}

// Fog in a sunny room of which the camera sees much in a mirror.
SceneBuilder mirror_in_fog(int light_vertices, int camera_points) {
  SceneBuilder b = SunnyRoom{.fog = .3, .light_vertices = light_vertices}.builder();
  b.scene.integrator.camera_points = camera_points;
  b.shape(RectangleShape{}, translate({0, 0, -.95}) * scale(.8), b.mirror());
  return b;
}

TEST(Mirrors, ShowTheSameFogWithAndWithoutPointsOnSegments) {
  Tests tests("property/mirrors");
  for (const int light_vertices : {-1, 1}) {
    const SceneBuilder points = mirror_in_fog(light_vertices, 2), none = mirror_in_fog(light_vertices, -1);
    ASSERT_THAT(render::describe(*world_of(points)).variant, testing::HasSubstr("aimed"));
    ASSERT_THAT(render::describe(*world_of(none)).variant, testing::Not(testing::HasSubstr("aimed")));
    const Comparison c = look(points, none, 41 + static_cast<std::uint64_t>(light_vertices), tests.level(3));
    EXPECT_EQ(c.verdict, Verdict::alike) << c.told;
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
