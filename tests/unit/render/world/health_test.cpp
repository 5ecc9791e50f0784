// Samples that are rejected, and samples that are kept although something is wrong with them: they are
// counted by cause, located, and replayed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/render_check.h"
#include "worker/render/math/processor.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::operator*;

TEST(Health, SamplesTooLargeToAddAreCountedAndContributeNothing) {
  // Two samples of the second value already exceed the range of float32.
  for (const double radiance : {1e30, 2e38}) {
    SceneBuilder builder({2, 2});
    builder.environment(radiance);
    const auto world = test::world_of(builder);
    const TileResult r = render_tile(*world, {0, 0, 2, 2}, {0, 16}, nullptr, nullptr);
    for (const float s : r.sums) EXPECT_EQ(s, 0.f) << radiance;
    EXPECT_EQ(r.health.nonfinite, 4u * 16) << radiance;
    EXPECT_EQ(r.health.causes.at(HealthCause::too_large).first.back(), (HealthLocation{0, 0, 7})) << radiance;
    EXPECT_FALSE(render_sample(*world, 0, 0, 0).finite) << radiance;
  }
  SceneBuilder builder({2, 2});
  builder.environment(1e28);
  const TileResult r = render_tile(*test::world_of(builder), {0, 0, 2, 2}, {0, 16}, nullptr, nullptr);
  for (const float s : r.sums) EXPECT_FLOAT_EQ(s, 8e28f);
  EXPECT_EQ(r.health.nonfinite, 0u);
}

// The lamp, which is too bright, is visible only in some pixels: exactly their samples are reported.
TEST(Health, RejectedSamplesAreLocatedByPixelAndReplayed) {
  SceneBuilder builder({4, 4});
  // Seen from a distance of 2, the view is 2 units wide and high. The lamp covers a quarter of that in each
  // direction: the second column and the third row.
  builder.lamp(RectangleShape{}, test::translate({-.5, 0, -.5}) * test::rotate_x(90) * test::scale(.25),
               {1e30, 0, 0});
  builder.look({0, -2, 0}, {0, 0, 0}, 2 * std::atan(.5) * 180 / test::kPi);
  const auto world = test::world_of(builder);
  const TileResult all = render_tile(*world, {0, 0, 4, 4}, {0, 6}, nullptr, nullptr);
  ASSERT_EQ(all.health.causes.size(), 1u);
  const HealthEntry& entry = all.health.causes.at(HealthCause::too_large);
  EXPECT_GT(entry.count, 0u);
  Health sum;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (const SampleRange range : {SampleRange{0, 2}, SampleRange{2, 6}}) {
        Health pixel;
        for (std::uint64_t s = range.s0; s < range.s1; ++s) {
          const SampleValue value = render_sample(*world, x, y, s);
          EXPECT_EQ(value.finite, value.health.clean());
          EXPECT_TRUE(value.finite || value.rgb[0] > 0x1p96);
          pixel.merge(value.health);
        }
        EXPECT_EQ(render_tile(*world, {x, y, x + 1, y + 1}, range, nullptr, nullptr).health, pixel);
        sum.merge(pixel);
      }
  EXPECT_EQ(sum, all.health);
  for (const HealthLocation& s : entry.first) EXPECT_FALSE(render_sample(*world, s.x, s.y, s.sample).finite);
  EXPECT_LT(entry.count, 16u * 6) << "only some pixels see it";
}

// No accepted scene is known to produce such samples, so the finished world is changed.
TEST(Health, EveryKindOfBadSampleHasItsCause) {
  const auto causes = [](auto spoil) {
    SceneBuilder builder({4, 4});
    builder.environment();
    builder.container(SphereShape{}, {}, builder.null(), builder.homogeneous({1, 1, 1}, {.5, .5, .5}));
    builder.look({0, -3, 0}, {0, 0, 0}, 30);
    const auto world = test::world_of(builder);
    spoil(const_cast<World&>(*world));
    return render_tile(*world, {0, 0, 4, 4}, {0, 16}, nullptr, nullptr).health;
  };
  const auto only = [](const Health& h, HealthCause cause) {
    return h.causes.size() == 1 && h.causes.contains(cause);
  };
  EXPECT_TRUE(causes([](World&) {}).clean());
  const Health nan =
      causes([](World& w) { w.media[0].sigma_s = C3(std::numeric_limits<float>::quiet_NaN()); });
  EXPECT_TRUE(only(nan, HealthCause::not_a_number)) << canonical_json(nan);
  EXPECT_EQ(nan.nonfinite, nan.causes.at(HealthCause::not_a_number).count);
  const Health infinite =
      causes([](World& w) { w.media[0].sigma_s = C3(std::numeric_limits<float>::infinity()); });
  EXPECT_TRUE(infinite.causes.contains(HealthCause::infinite)) << canonical_json(infinite);
  const Health below = causes([](World& w) { w.media[0].sigma_s = C3(-.5f); });
  EXPECT_TRUE(only(below, HealthCause::negative)) << canonical_json(below);
  EXPECT_EQ(below.nonfinite, 0u);
  EXPECT_GT(below.negative, 0u);
}

// A cube whose density exceeds the bound of its cell, because the test halves the bound. Grids that are read
// never violate their bounds.
struct OverItsBound {
  const char* name;
  VolumeFilter filter;
  bool channels, several;
};
std::shared_ptr<const World> over_its_bound(const OverItsBound& how, bool spoil) {
  SceneBuilder builder({4, 4});
  const Transform cube = test::translate({-1, -1, -1}) * test::scale(2);
  const int channels = how.channels ? 3 : 1;
  std::vector<float> values;
  for (int i = 0; i < 27 * channels; ++i) values.push_back(1 + .05f * static_cast<float>(i % 7));
  const auto fog = [&] {
    const VolumeIndex grid = builder.grid({3, 3, 3}, values, cube, channels);
    std::get<GridVolume>(builder.scene.volumes[grid.value]).filter = how.filter;
    return builder.heterogeneous(grid, {.5, .5, .5});
  };
  builder.container(CubeShape{}, {}, builder.null(), fog());
  if (how.several) builder.container(CubeShape{}, test::scale(.9), builder.null(), fog());
  builder.environment();
  builder.look({0, -4, 0}, {0, 0, 0}, 10);
  auto world = test::world_of(builder);
  if (!spoil) return world;
  for (const Medium& m : world->media)
    for (const Grid* grid : {m.density, m.by_channel[0], m.by_channel[1], m.by_channel[2]})
      if (grid != nullptr) const_cast<MacroCell&>(grid->cell(0, 0, 0)).hi *= .5f;
  return world;
}

TEST(Health, EveryTrackerCountsAndLocatesDensitiesAboveTheirBound) {
  for (const OverItsBound& how : {OverItsBound{"trilinear", VolumeFilter::trilinear, false, false},
                                  {"nearest", VolumeFilter::nearest, false, false},
                                  {"of each channel", VolumeFilter::trilinear, true, false},
                                  {"of several media", VolumeFilter::trilinear, false, true}}) {
    const auto count = [&](bool spoil) {
      return render_tile(*over_its_bound(how, spoil), {0, 0, 4, 4}, {0, 8}, nullptr, nullptr).health;
    };
    EXPECT_TRUE(count(false).clean()) << how.name;
    const Health health = count(true);
    ASSERT_GT(health.majorant_violations, 0u) << how.name;
    EXPECT_FALSE(health.clean()) << how.name;
    for (const HealthLocation& s : health.causes.at(HealthCause::majorant_violation).first) {
      const SampleValue again = render_sample(*over_its_bound(how, true), s.x, s.y, s.sample);
      EXPECT_TRUE(again.finite) << "it is kept, and told of";
      EXPECT_GT(again.health.majorant_violations, 0u) << how.name;
    }
  }
}

TEST(Health, CountsChangedInputsByCause) {
  SceneBuilder builder({2, 2});
  const VolumeIndex grid = builder.grid({2, 1, 1}, {-1, 1}, test::translate({-1, -1, -1}) * test::scale(2));
  builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(grid, {1, 1, 1}));
  builder.environment();
  Health expected;
  expected.add(HealthCause::negative_density, 1);
  EXPECT_EQ(changed_inputs(*test::world_of(builder)), expected);
}

// Denormal densities count as zeros while rays are traced, whatever the mode of the thread was before, and
// that mode is restored. So they cost as much time as zeros. (As numbers these densities would have, after
// scaling, an extinction of 8e-10, and would emit a radiance of 16 along 2 units.)
TEST(Health, DenormalNumbersAreZerosWhileRaysAreTracedInEveryThread) {
  SceneBuilder builder({4, 4});
  const VolumeIndex grid =
      builder.grid({2, 1, 1}, {8e-39f, 8e-39f}, test::translate({-1, -1, -1}) * test::scale(2));
  const MediumIndex medium = builder.heterogeneous(grid, {0, 0, 0}, 1e29);
  std::get<HeterogeneousMedium>(builder.scene.media[medium.value]).source_radiance =
      builder.constant({1e10, 1e10, 1e10});
  builder.container(CubeShape{}, {}, builder.null(), medium);
  builder.look({0, -5, 0}, {0, 0, 0}, 30);
  const auto world = test::world_of(builder);
  const std::uint64_t usual = FlushDenormals::read();
  std::vector<float> sums[2];
  for (const std::uint64_t zeros : {std::uint64_t{0}, FlushDenormals::kFlush}) {
    FlushDenormals::write((usual & ~FlushDenormals::kFlush) | zeros);
    sums[zeros ? 1 : 0] = render_tile(*world, {0, 0, 4, 4}, {0, 16}, nullptr, nullptr).sums;
    EXPECT_EQ(FlushDenormals::read() & FlushDenormals::kFlush, zeros);
  }
  FlushDenormals::write(usual);
  EXPECT_EQ(sums[0], sums[1]);
  EXPECT_THAT(sums[0], ::testing::Each(0.f));
}

}  // namespace
}  // namespace ls::render
