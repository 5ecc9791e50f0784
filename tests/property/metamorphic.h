// What the metamorphic tests share: the scenes that they change, and whether a change showed.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/property/compare.h"
#include "tests/property/random_scene.h"
#include "tests/property/structures.h"
#include "tests/property/watch.h"

namespace ls::test {

inline constexpr std::uint64_t kRandom = 12;  // scenes beside the different ones

// A random scene with a film of 12 x 12; nothing if it can't be built.
inline std::optional<NamedScene> calm_scene(std::uint64_t seed) {
  const RandomScene s = random_scene(seed, {.wild = 0, .calm = true});
  SceneBuilder builder;
  builder.scene = s.scene;
  builder.files = s.assets.files();
  builder.scene.film.size = {12, 12};
  builder.scene.film.crop_offset = {0, 0};
  builder.scene.film.crop_size = {0, 0};
  if (!render::build_world(builder.scene, settings_of(builder.scene), builder.files, 1)) return std::nullopt;
  return NamedScene{fmt::format("random scene {}", seed), builder};
}

// The different scenes and random ones that can be built.
inline std::vector<NamedScene> scenes() {
  std::vector<NamedScene> all = different_scenes();
  const auto [first, count] = scenes_to_try(kRandom);
  for (std::uint64_t seed = first; seed < first + count; ++seed)
    if (auto s = calm_scene(seed)) all.push_back(std::move(*s));
  return all;
}

// All of the scenes against what `change` makes of them (nothing: not of this one).
template <class Change>
void expect_alike(Tests& tests, const std::vector<NamedScene>& all, Change change, Looks looks = {}) {
  std::uint64_t compared = 0, undecided = 0, seed = 1000;
  for (const NamedScene& s : all) {
    seed += 10;
    const std::optional<SceneBuilder> other = change(s.builder);
    if (!other) continue;
    ++compared;
    const Comparison c = look(s.builder, *other, seed, tests.level(3), looks);
    undecided += c.verdict == Verdict::undecided;
    EXPECT_NE(c.verdict, Verdict::different) << s.name << ": " << c.told;
  }
  fmt::print("{} scenes compared, {} undecided\n", compared, undecided);
  EXPECT_GE(compared, 2u);
  EXPECT_LE(4 * undecided, compared + 4);
}

// With a share of their own.
template <class Change>
void expect_alike(std::string_view share, const std::vector<NamedScene>& all, Change change) {
  Tests tests(share);
  expect_alike(tests, all, change);
  tests.close();
}

}  // namespace ls::test
