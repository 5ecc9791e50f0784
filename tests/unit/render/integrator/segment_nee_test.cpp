// Tests the integrator `volpath_distant_mis` where the result is known exactly: its density of depths, its
// estimate of the light scattered on a segment, and the bits that it has in common with the default
// integrator.
#include "worker/render/integrator/segment_nee.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/render_check.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

// The density integrates to 1 over [0, length] at any optical depth; the test uses midpoints between
// quantiles. The textbook form returns 0 everywhere below depths of 6e-8.
TEST(TruncatedExponential, HasItsMassInTheInterval) {
  for (const double depth : {1e-30, 1e-12, 1e-7, 1e-3, 1., 30., 1e6}) {
    for (const float length : {1e-3f, 1.f, 1e4f}) {
      const auto sigma = static_cast<float>(depth / length);
      for (const double v : {1e-9, .01, .3, .5, .9, 1 - 1e-9}) {
        const float x = truncated_sample(sigma, length, v);
        ASSERT_GT(x, 0) << depth;
        ASSERT_LE(x, length) << depth;
        // The distribution function at x, in double.
        const double s = sigma, cdf = s * length < 1e-15 ? x / double{length}
                                                         : std::expm1(-s * x) / std::expm1(-s * length);
        EXPECT_NEAR(cdf, v, 1e-6 * v + 2e-7) << "depth " << depth << " length " << length;
        const double pdf = s * length < 1e-15 ? 1. / length : s * std::exp(-s * x) / -std::expm1(-s * length);
        if (pdf > 1e-30) EXPECT_NEAR(truncated_pdf(sigma, length, x) / pdf, 1, 4e-6 * std::max(1., s * x));
      }
    }
  }
}

TEST(TruncatedExponential, EqualsTheExponentialWithoutALimitAndIsZeroWithoutDepth) {
  EXPECT_FLOAT_EQ(truncated_pdf(2, kInfinity, .5f), 2 * std::exp(-1.f));
  EXPECT_FLOAT_EQ(truncated_sample(2, kInfinity, .5), std::log(2.f) / 2);
  EXPECT_EQ(truncated_pdf(0, kInfinity, .5f), 0);
  EXPECT_FALSE(std::isfinite(truncated_sample(0, kInfinity, .5)));
  EXPECT_EQ(truncated_pdf(0, 4, 1), .25f);
}

// The weights of strategies are numbers in [0, 1] even if their densities differ by the whole range of
// float32 (kMaxRatio), whatever the density of the light is.
TEST(SegmentLightVertex, SharesAreNumbersAtTheEndsOfFloat32) {
  using Vertex = SegmentNee<Features{}>::Vertex;
  constexpr float kTiny = 1e-45f, kHuge = std::numeric_limits<float>::max();
  for (const bool by_depth : {false, true})
    for (const float depth_ratio : {0.f, kTiny, 1.f, kMaxRatio})
      for (const float flight : {0.f, kTiny, 1e-38f, 1.f, kHuge})
        for (const float pivot : {0.f, 1e-30f, 1e-7f, 1.f, 1e30f}) {
          const Vertex v{by_depth, true, depth_ratio, flight, .5f, {0, 0, 0}, {1, 0, 0}, 1};
          for (const float found : {v.found_as_light(), v.found_as_light(V3(.5f, pivot, 0))}) {
            ASSERT_GE(found, 0);
            ASSERT_LE(found, kMaxRatio);
            for (const float p_s : {1e-30f, 1.f, 1e15f})
              for (const float p_l : {0.f, kTiny, 1.f, 1e30f, kHuge}) {
                const float share = p_s / (p_s + p_l * found);  // as PathTracer::add_emission
                ASSERT_TRUE(share >= 0 && share <= 1) << by_depth << ' ' << depth_ratio << ' ' << flight
                                                      << ' ' << pivot << ' ' << p_s << ' ' << p_l;
              }
          }
        }
}

SceneBuilder cloud_builder() {
  SceneBuilder builder({6, 4});
  std::vector<float> v(40 * 10 * 10, 0.f);
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] = i % 40 > 12 && i % 40 < 30 ? 1 + static_cast<float>(i % 7) : 0;
  const VolumeIndex grid = builder.grid({40, 10, 10}, v, translate({-2, -1, -1}) * test::scale(4, 2, 2));
  builder.container(CubeShape{}, test::scale(2, 1, 1), builder.null(),
                    builder.heterogeneous(grid, {.9, .8, .7}));
  builder.scene.emitters.push_back(PointEmitter{{1, .2, .1}, {1, 2, 3}});
  builder.look({-4, .1, .1}, {0, 0, 0}, 20, {0, 1, 0});
  return builder;
}

TEST(StretchOfAGrid, IsSymmetricAndSkipsEmptyEnds) {
  const auto world = test::world_of(cloud_builder());
  const Medium& m = world->media.at(0);
  ASSERT_TRUE(m.grid);
  const float half = static_cast<float>(world->geometry.scale);
  for (const float reach : {kInfinity, 1.9f * half}) {
    const V3 o = V3(-2 * half, .1f * half, .05f * half), d(1, 0, 0);
    const OpticalDepth s(m, o, d, reach);
    ASSERT_GT(s.total(), 0);
    EXPECT_GT(s.from(), .5f * half) << "the cells before the cloud are empty";
    EXPECT_LE(s.to(), std::min(reach, 4 * half));
    EXPECT_LT(s.to(), 3.9f * half);
    float before = 0;
    for (int i = 1; i < 200; ++i) {
      const OpticalDepth::Point there = s.after(s.total() * static_cast<float>(i) / 200);
      EXPECT_GE(there.t, before);
      before = there.t;
      EXPECT_GT(there.rate, 0);
      EXPECT_NEAR(s.at(there.t).x / there.x, 1, 1e-4);
    }
    EXPECT_EQ(s.at(s.to() + .1f * half).rate > 0, false);
  }
}

TEST(DistantMis, EveryCoveringVariantGivesTheSameBits) {
  for (const bool grid : {false, true}) {
    SceneBuilder builder = cloud_builder();
    if (!grid) {
      const MediumIndex m = builder.homogeneous({1, 1, 1}, {.9, .8, .7}, .3);
      builder.scene.shapes[0].interior = m;
    }
    builder.shape(RectangleShape{}, translate({0, 0, 3}) * test::rotate_x(180), builder.diffuse(.5)).emitter =
        AreaEmitter{builder.texture({1, 2, 3})};
    builder.scene.integrator.name = "volpath_distant_mis";
    for (const auto distance :
         {DistanceSampling::exponential, DistanceSampling::equiangular, DistanceSampling::mis}) {
      builder.scene.integrator.distance = distance;
      const auto world = test::world_of(builder);
      const auto names = covering_variants(*world);
      EXPECT_EQ(names.size(),
                grid ? 5u : 6u);  // including those for all phase functions and for light in parts
      const auto first = render_tile_as(*world, names.front(), {0, 0, 6, 4}, {0, 32});
      for (const std::string& name : names)
        EXPECT_EQ(render_tile_as(*world, name, {0, 0, 6, 4}, {0, 32}).sums, first.sums) << name;
      EXPECT_EQ(first.health.nonfinite, 0u);
    }
  }
}

// Light that next-event estimation cannot sample is found by phase-function sampling alone, in both
// integrators.
TEST(DistantMis, IsTheDefaultIntegratorToTheBitWhereNoLightCanBeSampled) {
  SceneBuilder builder = cloud_builder();
  builder.scene.emitters.clear();
  builder.environment(.5);
  const auto render = [&](const char* name) {
    builder.scene.integrator.name = name;
    return render_tile(*test::world_of(builder), {0, 0, 6, 4}, {0, 64}, nullptr, nullptr).sums;
  };
  EXPECT_EQ(render("volpath_distant_mis"), render("volpath"));
}

TEST(DistantMis, SettingsReachTheRenderer) {
  SceneBuilder builder = cloud_builder();
  builder.scene.integrator.name = "volpath_distant_mis";
  std::vector<std::vector<float>> pictures;
  for (const auto& [distance, heuristic] : {std::pair{DistanceSampling::exponential, MisHeuristic::power},
                                            std::pair{DistanceSampling::equiangular, MisHeuristic::power},
                                            std::pair{DistanceSampling::mis, MisHeuristic::power},
                                            std::pair{DistanceSampling::mis, MisHeuristic::balance}}) {
    builder.scene.integrator.distance = distance;
    builder.scene.integrator.heuristic = heuristic;
    pictures.push_back(render_tile(*test::world_of(builder), {0, 0, 6, 4}, {0, 16}, nullptr, nullptr).sums);
    for (std::size_t i = 0; i + 1 < pictures.size(); ++i) EXPECT_NE(pictures[i], pictures.back());
  }
}

TEST(DistantMis, FindsTheLightOfADenseCloudWithoutNonFiniteSamples) {
  SceneBuilder builder = cloud_builder();
  std::get<HeterogeneousMedium>(builder.scene.media[0]).scale = 1e6;
  builder.scene.integrator.name = "volpath_distant_mis";
  builder.lamp(SphereShape{}, translate({0, 0, .5}) * test::scale(.01), {1, 2, 3});
  const auto out = render_tile(*test::world_of(builder), {0, 0, 6, 4}, {0, 64}, nullptr, nullptr);
  EXPECT_EQ(out.health.nonfinite, 0u);
  EXPECT_EQ(out.health.negative, 0u);
}

}  // namespace
}  // namespace ls::render
