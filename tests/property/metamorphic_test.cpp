// What must not change an image: where and how large a scene is, which way it is turned, which channel is
// which, how its light and its space are divided. Exact where floating point allows it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/metamorphic.h"
#include "tests/property/moved.h"

namespace ls::test {
namespace {

std::vector<float> pixels(const SceneBuilder& builder, std::uint64_t spp) {
  const FrameSize size = builder.scene.film.image_size();
  const PixelRect all{0, 0, size.width, size.height};
  return render::render_tile(*world_of(builder), all, {0, spp}, nullptr, nullptr).sums;
}
SceneBuilder moved(const SceneBuilder& builder, const Move& m) {
  SceneBuilder out = builder;
  out.scene = moved(builder.scene, m);
  return out;
}

// ---- where, how large, which way round
// The world is recentred and scaled to unit size by a power of two before anything is rounded.
TEST(Metamorphic, ScalingByPowersOfTwoChangesNoBit) {
  for (const NamedScene& s : scenes()) {
    const auto before = pixels(s.builder, 2);
    for (const int k : {-14, -1, 3, 20})
      EXPECT_EQ(pixels(moved(s.builder, {{}, std::ldexp(1., k)}), 2), before) << s.name << " times 2^" << k;
  }
}

TEST(Metamorphic, ScalingChangesNothing) {
  int i = 0;
  expect_alike("property/scaling", scenes(), [&](const SceneBuilder& builder) {
    constexpr double kScales[] = {1e-4, 1e-2, 7, 1e3, 1e6};
    return std::optional(moved(builder, {{}, kScales[i++ % 5]}));
  });
}

// Binary fractions of a few digits stay exact in double.
TEST(Metamorphic, ShiftByAPowerOfTwoKeepsAllBitsOfExactCoordinates) {
  for (const NamedScene& s : different_scenes()) {
    if (s.name == "coloured fog") continue;  // the directions of its spot light are no short fractions
    EXPECT_EQ(pixels(moved(s.builder, {{}, 1, {0x1p17, -0x1p16, 0x1p17}}), 2), pixels(s.builder, 2))
        << s.name;
  }
}

TEST(Metamorphic, TranslationChangesNothing) {
  expect_alike("property/shifting", scenes(), [](const SceneBuilder& builder) {
    return std::optional(moved(builder, {{}, 1, {1e5, -1e5, 1e5}}));
  });
}

TEST(Metamorphic, RotationChangesNothing) {
  const Transform turn = rotate_x(37) * rotate_y(101) * rotate_x(-15);
  expect_alike("property/turning", scenes(),
               [&](const SceneBuilder& builder) { return std::optional(moved(builder, {turn})); });
}

// The hero channel is chosen by position, so it is exact for no scene.
TEST(Metamorphic, ExchangingChannelsExchangesThemInTheImage) {
  std::vector<NamedScene> all = scenes();
  std::erase_if(all, [](const NamedScene& s) { return !can_be_permuted(s.builder.scene); });
  // Few random scenes can be permuted, so more are drawn until there are enough.
  constexpr std::size_t kEnough = 6, kMostDraws = 200;
  const auto [first, count] = scenes_to_try(kRandom);
  for (std::uint64_t more = first + count; all.size() < kEnough && more < first + count + kMostDraws; ++more)
    if (auto s = calm_scene(more); s && can_be_permuted(s->builder.scene)) all.push_back(std::move(*s));
  Tests tests("property/channels");
  std::uint64_t seed = 5000;
  for (const NamedScene& s : all) {
    SceneBuilder other = s.builder;
    other.scene = permuted(s.builder.scene, {1, 2, 0});
    const auto at = [&](std::uint64_t spp, double alpha) {
      Estimate a = estimate(s.builder, spp, ++seed);
      const Estimate b = estimate(other, spp, ++seed);
      for (auto* list : {&a.mean, &a.standard_error, &a.freedom})
        *list = {(*list)[1], (*list)[2], (*list)[0]};
      return compare(a, b, alpha);
    };
    const double level = tests.level(3);
    Comparison c = at(64, .01);
    if (c.verdict != Verdict::alike) c = at(1024, level);
    EXPECT_NE(c.verdict, Verdict::different) << s.name << ": " << c.told;
  }
  tests.close();
  EXPECT_GE(all.size(), kEnough);
}

// ---- light
TEST(Metamorphic, TwoHalvesOfALightEqualTheLight) {
  expect_alike("property/two_halves", scenes(),
               [](const SceneBuilder& builder) -> std::optional<SceneBuilder> {
                 SceneBuilder out = builder;
                 const std::size_t n = builder.scene.emitters.size();
                 for (std::size_t i = 0; i < n; ++i) {
                   if (!may_stand_twice(builder.scene.emitters[i])) continue;
                   dim(out.scene.emitters[i], .5);
                   out.scene.emitters.push_back(out.scene.emitters[i]);
                 }
                 return out.scene.emitters.size() > n ? std::optional(out) : std::nullopt;
               });
}

TEST(Metamorphic, TheImageIsTheSumOverItsLights) {
  std::uint64_t seed = 9000;
  const std::vector<NamedScene> all = scenes();
  Tests tests("property/sum_of_lights");
  for (const NamedScene& s : all) {
    const Scene& scene = s.builder.scene;
    if (scene.emitters.size() < 2) continue;
    const auto at = [&](std::uint64_t spp, double alpha) {
      Estimate sum;
      sum.freedom = {1e9, 1e9, 1e9};
      const auto add = [&](const SceneBuilder& builder) {
        const Estimate e = estimate(builder, spp, ++seed);
        for (std::size_t c = 0; c < 3; ++c) {
          sum.mean[c] += e.mean[c];
          sum.standard_error[c] = std::hypot(sum.standard_error[c], e.standard_error[c]);
          if (e.standard_error[c] > 0) sum.freedom[c] = std::min(sum.freedom[c], e.freedom[c]);
        }
      };
      // What shapes and media give off stays with the first.
      for (std::size_t i = 0; i < scene.emitters.size(); ++i) {
        SceneBuilder one = s.builder;
        one.scene.emitters = {scene.emitters[i]};
        if (i > 0) {
          for (Shape& shape : one.scene.shapes) shape.emitter.reset();
          for (Medium& m : one.scene.media) {
            if (auto* h = std::get_if<HomogeneousMedium>(&m)) h->emission = h->source_radiance = {0, 0, 0};
            if (auto* h = std::get_if<HeterogeneousMedium>(&m)) h->emission_scale = 0;
          }
        }
        add(one);
      }
      return compare(sum, estimate(s.builder, spp, ++seed), alpha);
    };
    const double level = tests.level(3);
    Comparison c = at(64, .01);
    if (c.verdict != Verdict::alike) c = at(1024, level);
    EXPECT_NE(c.verdict, Verdict::different) << s.name << ": " << c.told;
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
