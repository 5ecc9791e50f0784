// Tests of the slices of a deep image.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/image/aov/deep_planes.h"
#include "tests/support/significance.h"
#include "tests/unit/render/integrator/aov_picture.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

constexpr int kSlices = 6;

// A cube of side 2 in front of the wall, filled with this medium: from depth 2 to depth 4 of the camera,
// which sees the wall at depth 5.
void fill(SceneBuilder& builder, MediumIndex medium) {
  builder.container(CubeShape{}, translate({0, 0, 2}), builder.null(), medium);
}
SceneBuilder fog(const std::array<double, 3>& sigma) {
  SceneBuilder builder = wall();
  builder.scene.film.transparent = true;
  fill(builder, builder.homogeneous({sigma[0], sigma[1], sigma[2]}, {.5, .5, .5}));
  return builder;
}
void remove_wall(SceneBuilder& builder) { builder.scene.shapes.erase(builder.scene.shapes.begin()); }

struct Slices {
  std::vector<double> edges, through;  // by record
  std::vector<std::array<double, 3>> light;
};
Slices slices_of(const Picture& p, std::size_t pixel = 0, std::size_t slices = kSlices) {
  Slices out;
  for (std::size_t k = 0; k <= slices; ++k) {
    out.edges.push_back(p.sum(fmt::format("deep.{:02}.E", k), pixel));
    out.through.push_back(p.of_all(fmt::format("deep.{:02}.T", k), pixel));
    out.light.push_back({});
    for (std::size_t c = 0; c < 3; ++c)
      out.light.back()[c] = p.of_all(fmt::format("deep.{:02}.{}", k, "RGB"[c]), pixel);
  }
  return out;
}

// Lengths in the cube are differences of float32 depths in a world of unit size, accurate to 4 kClose (as in
// opacity_test.cpp); the optical depth of a slice, to sigma times that.
TEST(DeepSlices, OfAHomogeneousSlabLetThroughByTheirThickness) {
  for (const double sigma : {.2, 1., 4.}) {
    SceneBuilder builder = fog({sigma, sigma, sigma});
    remove_wall(builder);
    const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));

    EXPECT_NEAR(s.edges.front(), 2, 16 * kClose);
    EXPECT_NEAR(s.edges.back(), 4, 16 * kClose);
    double before = 1;
    for (std::size_t k = 0; k < kSlices; ++k) {
      EXPECT_LT(s.edges[k], s.edges[k + 1]) << "every slice is used";
      const double alpha = 1 - s.through[k] / before;
      EXPECT_NEAR(alpha, 1 - std::exp(-sigma * (s.edges[k + 1] - s.edges[k])), 16 * kClose * (1 + sigma));
      before = s.through[k];
    }
    EXPECT_NEAR(s.through.back(), std::exp(-2 * sigma), 4 * kClose);
  }
}

TEST(DeepSlices, TakeAboutTheSameShareOfTheLight) {
  SceneBuilder builder = fog({8, 8, 8});
  remove_wall(builder);
  const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));
  double before = 1;
  for (std::size_t k = 0; k < kSlices; ++k) {
    EXPECT_GT(before - s.through[k], .05) << k;
    before = s.through[k];
  }
  EXPECT_GT(s.through[kSlices - 2], .05) << "no slice is seen through nothing";
}

// The integral of e exp(-sigma z) over each slice of a medium that absorbs and shines.
TEST(DeepSlices, HaveTheEmissionOfTheirPartOfAMedium) {
  const double sigma = 1.5;
  for (const double albedo : {0., .5}) {
    SceneBuilder builder = wall();
    builder.scene.film.transparent = true;
    fill(builder, builder.homogeneous({sigma, sigma, sigma}, {albedo, albedo, albedo}));
    for (auto& m : builder.scene.media) std::get<HomogeneousMedium>(m).emission = {3, 3, 3};
    remove_wall(builder);
    builder.scene.emitters.clear();
    const Slices s = slices_of(Picture(builder, {"emission"}, kSamples, kSlices));
    for (std::size_t k = 0; k < kSlices && albedo == 0; ++k)
      for (const double light : s.light[k]) {
        const double from = s.edges[k] - 2, to = s.edges[k + 1] - 2;
        EXPECT_NEAR(light, 3 / sigma * (std::exp(-sigma * from) - std::exp(-sigma * to)), 3 * 32 * kClose);
      }
    const Picture p(builder, {"emission"}, kSamples, kSlices);
    double sum = 0;
    for (const auto& light : s.light) sum += light[1];
    EXPECT_NEAR(sum, p.whole(1, 0) / kSamples, 64 * kClose);
  }
}

TEST(DeepSlices, HaveASurfaceBehindFogInASliceOfItsOwn) {
  const Slices s = slices_of(Picture(fog({.5, .5, .5}), {}, kSamples, kSlices));

  std::size_t surface = kSlices;
  for (std::size_t k = 0; k < kSlices; ++k)
    if (s.edges[k] < 0) surface = k;
  ASSERT_LT(surface, std::size_t{kSlices});
  // The slice is larger than the surface's depths by a share of 1e-5 of them.
  EXPECT_NEAR(-s.edges[surface], 5, 5 * 1.1e-5);
  EXPECT_NEAR(std::abs(s.edges[surface + 1]), 5, 5 * 1.1e-5);
  EXPECT_NEAR(s.through[surface - 1], std::exp(-1.), 4 * kClose);
  EXPECT_EQ(s.through[surface], 0);
  EXPECT_GT(s.light[surface][0], 0);
}

TEST(DeepSlices, HaveTheEnvironmentBehindEverything) {
  SceneBuilder builder = fog({.5, .5, .5});
  builder.scene.film.transparent = false;
  remove_wall(builder);
  const Slices s = slices_of(Picture(builder, {}, 1024, kSlices));
  EXPECT_NEAR(s.through[kSlices - 1], std::exp(-1.), 4 * kClose);
  EXPECT_EQ(s.through[kSlices], 0);
  // The environment has the radiance 1; paths pass the fog with the probability exp(-1). The share of 1024
  // samples of a Sobol sequence in one dimension deviates by at most one sample in each half.
  EXPECT_NEAR(s.light[kSlices][0], std::exp(-1.), 2 / 1024. + 4 * kClose);
}

TEST(DeepSlices, OfNothingAreEmptyAndFar) {
  SceneBuilder builder = wall();
  builder.scene.film.transparent = true;
  remove_wall(builder);
  const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));
  for (std::size_t k = 0; k <= kSlices; ++k) {
    EXPECT_EQ(s.edges[k], static_cast<float>(kDeepFar));
    EXPECT_EQ(s.through[k], 1);
    EXPECT_EQ(s.light[k][0], 0);
  }
}

TEST(DeepSlices, OfAHoldoutLetThroughWhatIsInFrontOfIt) {
  SceneBuilder builder = fog({.5, .5, .5});
  builder.scene.shapes[0].holdout = true;
  const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));
  EXPECT_NEAR(s.through.back(), std::exp(-1.), 4 * kClose);
}

TEST(DeepSlices, BeginAtACameraInsideAMedium) {
  SceneBuilder builder = wall();
  const MediumIndex medium = builder.homogeneous({.5, .5, .5}, {.9, .9, .9});
  builder.container(CubeShape{}, test::scale(20), builder.null(), medium);
  builder.scene.sensor.medium = medium;
  const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));
  EXPECT_NEAR(s.edges.front(), 0, .02) << "near clip";
  EXPECT_NEAR(s.through[kSlices - 2], std::exp(-2.5), .01);
  EXPECT_EQ(s.through.back(), 0);
}

TEST(DeepSlices, MayBeOneOrMany) {
  for (const int slices : {1, 2, 3, static_cast<int>(kMostDeepSlices)}) {
    const Picture p(fog({1, 1, 1}), {}, kSamples, slices);
    const Slices s = slices_of(p, 0, static_cast<std::size_t>(slices));
    double light = 0;
    for (const auto& l : s.light) light += l[1];
    EXPECT_NEAR(light, p.whole(1, 0) / kSamples, 64 * kClose) << slices;
    EXPECT_EQ(s.through.back(), 0);
  }
}

// With an estimate for each edge, the medium of a grid lets less through from slice to slice only on average.
TEST(DeepSlices, OfAGridLetThroughWhatItsDensitySays) {
  SceneBuilder builder({16, 16});
  builder.look({0, 0, 7}, {0, 0, 0}, 1e-3, {0, 1, 0});
  fill(builder, builder.heterogeneous(
                    builder.grid({1, 1, 2}, {0, 3}, translate({-1, -1, 1}) * test::scale(2)), {.9, .9, .9}));
  const Picture p(builder, {"alpha"}, 256, kSlices);
  // Voxels have their centres at a quarter and three quarters of the way; the density is linear in between
  // and constant outside. From the camera, at depth 4, it is first 3 and then falls.
  const auto optical = [](double z) {
    const double t = std::clamp(z - 4, 0., 2.);
    const double falling = std::clamp(t - .5, 0., 1.);
    return 3 * std::min(t, .5) + 3 * (falling - falling * falling / 2);
  };
  for (std::size_t k = 0; k + 1 < kSlices; ++k) {
    double mean = 0, squares = 0, expected = 0;
    for (std::size_t i = 0; i < p.pixels(); ++i) {
      const Slices s = slices_of(p, i);
      mean += s.through[k] / static_cast<double>(p.pixels());
      squares += s.through[k] * s.through[k] / static_cast<double>(p.pixels());
      expected += std::exp(-optical(s.edges[k + 1])) / static_cast<double>(p.pixels());
    }
    const double error = std::sqrt(std::max(0., squares - mean * mean) / static_cast<double>(p.pixels()));
    EXPECT_NEAR(mean, expected, test::kStandardErrors * error + 32 * kClose) << "edge " << k + 1;
  }
}

// Lamps of Blender and USD let light through.
TEST(DeepSlices, HaveALampThatIsLookedThroughInASliceOfItsOwn) {
  for (const bool with_wall : {true, false}) {
    SceneBuilder builder = wall();
    builder.scene.film.transparent = true;
    builder.shape(RectangleShape{}, translate({0, 0, 2}) * test::scale(2), builder.null()).emitter =
        AreaEmitter{builder.texture({5, 5, 5})};
    if (!with_wall) remove_wall(builder);
    const Slices s = slices_of(Picture(builder, {}, kSamples, kSlices));

    // The edge is the middle of probes' depths, which are accurate to 4 kClose.
    EXPECT_NEAR(s.edges[0], -3, 3 * 4 * kClose);
    EXPECT_NEAR(s.light[0][1], 5, 5 * kClose);
    EXPECT_EQ(s.through[0], 1);
    EXPECT_EQ(s.light[kSlices][1], 0) << "nothing is infinitely far";
    EXPECT_EQ(s.through[kSlices], with_wall ? 0 : 1);
    if (with_wall) {
      EXPECT_NEAR(s.edges[1], -5, 5 * 4 * kClose);
    }
  }
}

// A small black rectangle, seen turned by 20 degrees, in front of a floor that shines: at its rims, samples
// meet surfaces beside the probes.
SceneBuilder rims() {
  SceneBuilder builder({16, 16});
  const BsdfIndex black = builder.diffuse(0);
  builder.shape(RectangleShape{}, test::scale(5), black).emitter = AreaEmitter{builder.texture({9, 9, 9})};
  builder.shape(RectangleShape{}, translate({0, 0, 4}) * test::scale(.5), black);
  builder.scene.film.transparent = true;
  builder.look({0, 0, 10}, {0, 0, 0}, 20, {.342, .94, 0});
  return builder;
}

TEST(DeepSlices, HaveNoFogBetweenSurfaces) {
  const Picture p(rims(), {}, 64, kSlices);
  std::size_t at_rims = 0;
  for (std::size_t i = 0; i < p.pixels(); ++i) {
    const Slices s = slices_of(p, i);
    double before = 1;
    std::size_t surfaces = 0;
    for (std::size_t k = 0; k <= kSlices; before = s.through[k++]) {
      if (s.light[k][0] == 0 && s.through[k] == before) continue;
      ++surfaces;
      ASSERT_LT(k, std::size_t{kSlices}) << i;
      // Rays in the corners are longer by 1 / cos(14 degrees), 3.1 %.
      const bool front = s.edges[k] <= -5.99 && s.edges[k] >= -6.2, floor = s.edges[k] <= -9.99;
      EXPECT_TRUE(front || floor) << "pixel " << i << ": " << s.edges[k];
      // Where all 16 probes meet the rectangle, the floor beside it counts there: less than two probes'
      // share.
      EXPECT_TRUE(floor || s.light[k][0] < 9 * 2 / 16.) << s.light[k][0];
    }
    at_rims += surfaces > 1;
  }
  EXPECT_GT(at_rims, 10u);
}

// The fog of a slice takes its share of the light, and rays end on surfaces only in the slices of surfaces.
TEST(DeepSlices, OfFogHaveNoSurfaceInThem) {
  SceneBuilder builder = rims();
  const double sigma = .05;
  builder.container(CubeShape{}, translate({0, 0, 4}) * test::scale(3), builder.null(),
                    builder.homogeneous({sigma, sigma, sigma}, {.5, .5, .5}));
  const Picture p(builder, {}, 64, kSlices);
  for (std::size_t i = 0; i < p.pixels(); ++i) {
    const Slices s = slices_of(p, i);
    double before = 1;
    for (std::size_t k = 0; k < kSlices; before = s.through[k++]) {
      if (s.edges[k] < 0 || before == 0) continue;
      // Rays differ in length by less than 3.1 %, and so do the ends of a slice for surfaces.
      const double length = std::abs(s.edges[k + 1]) - s.edges[k];
      EXPECT_GE(s.through[k] / before, std::exp(-sigma * (length + .031 * 10)) - 64 * kClose)
          << "pixel " << i << ", slice " << k;
    }
  }
}

TEST(DeepSlices, CostNothingWhereNobodyAsks) {
  const Picture plain(hall(true, true), {}), deep(hall(true, true), {}, kSamples, kSlices);
  EXPECT_EQ(plain.beauty(), deep.beauty());
}

}  // namespace
}  // namespace ls::render
