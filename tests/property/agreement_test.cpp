// Integrators that claim a scene give the same image: those of random scenes that someone could have meant
// are compared in means over parts of the frame. Two stages: where a first look is suspicious, a second with
// fresh numbers and 16 times as many decides, at a level that keeps a right renderer from failing anywhere in
// the whole run with more than this file's share of the suite's rate. The seeds are fixed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/property/compare.h"
#include "tests/property/random_scene.h"
#include "tests/property/watch.h"

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
    s.scene.integrator = base;
    const auto world = render::build_world(s.scene, settings_of(s.scene), s.assets.files(), 1);
    if (!world) continue;
    const int part = static_cast<int>(seed % 4);

    if (render::covering_variants(**world).front().starts_with("surfaces")) {
      // Nothing for them to differ in: the same bits.
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

}  // namespace
}  // namespace ls::test
