// Pruning a scene (core/scene/analysis/prune.h) before it becomes a job changes no image:
// random scenes beside themselves as they are sent. The same bits, but where decision 0012 names an
// exception: without a surface that light passes, a medium or a layer of a blend, paths draw other numbers,
// and means are compared as in agreement_test.cpp.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/scene/analysis/prune.h"
#include "tests/property/compare.h"
#include "tests/property/random_scene.h"
#include "tests/property/watch.h"

namespace ls::test {
namespace {

constexpr std::uint64_t kPrunedScenes = 240;  // of a usual run

SceneBuilder builder_of(const RandomScene& s, const Scene& scene) {
  SceneBuilder builder;
  builder.scene = scene;
  builder.files = s.assets.files();
  builder.scene.film.size = {12, 12};
  return builder;
}

TEST(RandomScenes, GiveTheSameImageWithoutWhatIsLeftOut) {
  const auto [first, count] = scenes_to_try(kPrunedScenes);
  Tests tests("property/pruned");
  std::uint64_t pruned_ones = 0, by_bits = 0, undecided = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const RandomScene s = random_scene(seed, {.wild = 0, .calm = true});
    const Watch watch(told(s));
    const auto whom = scene::pruned_for(s.scene.integrator.name, s.scene.integrator.max_depth);
    if (!whom.media && !s.scene.media.empty()) continue;  // `path` is asked to render without them
    const scene::Pruned sent = scene::pruned(s.scene, whom);
    if (sent.left_out.empty()) continue;
    if (!render::build_world(s.scene, settings_of(s.scene), s.assets.files(), 1)) continue;
    ++pruned_ones;
    const SceneBuilder whole = builder_of(s, s.scene), part = builder_of(s, sent.scene);
    // By bits first: nearly all are, and where they are not, means decide.
    if (estimate(whole, 4).mean == estimate(part, 4).mean) {
      ++by_bits;
      continue;
    }
    const Comparison c = look(whole, part, 10 * seed, tests.level(3));
    undecided += c.verdict == Verdict::undecided;
    if (c.verdict == Verdict::different) {
      std::string out;
      for (const scene::LeftOut& l : sent.left_out) out += fmt::format("left out: {}: {}\n", l.what, l.why);
      ADD_FAILURE() << c.told << out << told(s);
    }
  }
  fmt::print("{} scenes, of {} something is left out, {} the same bits, {} undecided\n", count, pruned_ones,
             by_bits, undecided);
  if (count == kPrunedScenes) tests.close();
  EXPECT_GE(20 * pruned_ones, count);
  EXPECT_LE(10 * undecided, pruned_ones + 10);
}

}  // namespace
}  // namespace ls::test
