// Paths that serve several pixels bring the same image as paths that serve one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "tests/support/lamp_room.h"
#include "tests/support/significance.h"
#include "tests/support/sky_yard.h"

namespace ls::test {
namespace {

// A point light on the way to which stands a glass ball, and a mirror ball: paths begin with delta lobes.
SceneBuilder mirrors(int path_reuse) {
  SceneBuilder b = LampRoom{.path_reuse = path_reuse}.builder();
  b.scene.emitters.push_back(PointEmitter{{-.5, .8, .5}, {.5, .6, .7}});
  b.shape(SphereShape{{.2, -.7, -.2}, .3}, {}, b.glass(1.5));
  b.shape(SphereShape{{-.2, -.3, -.6}, .3}, {}, b.mirror());
  return b;
}

// A sheet that reflects and transmits, with first vertices on both of its sides.
SceneBuilder leaf(int path_reuse) {
  SceneBuilder b = LampRoom{.path_reuse = path_reuse}.builder();
  b.shape(RectangleShape{}, translate({0, -.3, -.2}) * rotate_y(60) * scale(.6),
          b.bsdf(DiffuseTransmissionBsdf{b.texture({.7, .3, .2}), b.texture({.1, .5, .3})}));
  return b;
}

// A room with two sheets that let a part of the light pass straight on: one diffuse, of which both sides have
// first and second vertices, and one of coloured glass.
SceneBuilder sheets(LampRoom room, int path_reuse) {
  room.path_reuse = path_reuse;
  SceneBuilder b = room.builder();
  const BsdfIndex red = b.bsdf(DiffuseBsdf{b.texture({.8, .4, .3})});
  b.shape(RectangleShape{}, translate({0, -.3, -.2}) * rotate_y(60) * scale(.7),
          b.bsdf(MaskBsdf{b.texture({.4, .4, .4}), b.bsdf(TwoSidedBsdf{red, red})}));
  b.shape(RectangleShape{}, translate({.1, .1, .1}) * rotate_x(50) * scale(.6),
          b.bsdf(ThinDielectricBsdf{1.5, 1, b.texture({1, 1, 1}), b.texture({.9, .5, .7})}));
  return b;
}
// Sheets and boundaries passed count for the maximum depth, so that tails differ in how far they go on.
SceneBuilder counted_sheets(int path_reuse) {
  SceneBuilder b = sheets({.max_depth = 5}, path_reuse);
  b.scene.integrator.name = "path";
  b.shape(CubeShape{}, translate({.1, -.5, -.1}) * scale(.3), b.null());
  return b;
}

// Under a sky that the first surface looks for twice, with a sheet with holes.
SceneBuilder under_sky(int path_reuse) {
  SceneBuilder b = sky_yard({16, 16});
  b.scene.integrator.path_reuse = path_reuse;
  return b;
}
// Under a sky with an image, beside the constant one, and a sun of a single direction.
SceneBuilder under_sky_image(int path_reuse) {
  SceneBuilder b = under_sky(path_reuse);
  SkyImage image(8, 5, .2f);
  image.set(2, 2, {9, 4, 2});
  image.set(5, 3, {1, 4, 6});
  add_sky(b, image);
  b.scene.emitters.push_back(DirectionalEmitter{{.4, .5, -1}, {1, 2, 1}});
  return b;
}
// Under a wide sun, whose disk paths hit, too.
SceneBuilder under_sun(int path_reuse) {
  SceneBuilder b = under_sky(path_reuse);
  b.scene.emitters.push_back(DirectionalEmitter{{.2, .3, -1}, {3, 2, 1}, 25});
  return b;
}

// The means of the quarters of an image of 16 x 16, in each channel: sharing moves light between pixels, and
// in a white room keeps the mean of all of them whatever the weights. Pixels that share tell too little of
// the error of a mean; images of different seeds are independent.
constexpr int kSide = 16;
constexpr std::size_t kQuarters = 4 * 3;
struct Quarters {
  std::array<double, kQuarters> mean{}, variance{};  // of the mean
};
Quarters quarters_of(const SceneBuilder& builder, std::uint64_t spp, int seeds, std::uint64_t first) {
  Quarters all;
  std::array<double, kQuarters> squares{};
  for (int i = 0; i < seeds; ++i) {
    const auto world = world_of(builder, first + static_cast<std::uint64_t>(i), 2);
    const auto sums = render::render_tile(*world, {0, 0, kSide, kSide}, {0, spp}, nullptr, nullptr).sums;
    std::array<double, kQuarters> image{};
    for (std::size_t plane = 0; plane < 6; ++plane)
      for (std::size_t p = 0; p < kSide * kSide; ++p) {
        const std::size_t right = p % kSide >= kSide / 2, below = p / kSide >= kSide / 2;
        image[(2 * below + right) * 3 + plane % 3] +=
            double{sums[plane * kSide * kSide + p]} / (static_cast<double>(spp) * kSide * kSide / 4);
      }
    for (std::size_t q = 0; q < kQuarters; ++q) {
      all.mean[q] += image[q] / seeds;
      squares[q] += image[q] * image[q] / seeds;
    }
  }
  for (std::size_t q = 0; q < kQuarters; ++q)
    all.variance[q] = (squares[q] - all.mean[q] * all.mean[q]) / (seeds - 1);
  return all;
}

TEST(PathReuse, GivesTheSameImageAsPathsAlone) {
  constexpr int kSeeds = 24;
  Tests tests("property/path_reuse");
  struct Rival {
    const char* name;
    std::function<SceneBuilder(int path_reuse)> scene;
  };
  const auto room = [](LampRoom r) {
    return [r](int path_reuse) mutable {
      r.path_reuse = path_reuse;
      return r.builder();
    };
  };
  const Rival rivals[] = {
      {"diffuse", room({})},
      {"glossy", room({.glossy = true})},
      {"fog", room({.fog = .8})},
      {"glossy in fog", room({.glossy = true, .fog = .4})},
      {"chromatic fog", room({.fog = 1, .chromatic = true})},
      {"mirrors", mirrors},
      {"leaf", leaf},
      {"sheets", [](int n) { return sheets({}, n); }},
      {"sheets in chromatic fog", [](int n) { return sheets({.fog = .6, .chromatic = true}, n); }},
      {"counted sheets", counted_sheets},
      {"sky", under_sky},
      {"sky with an image", under_sky_image},
      {"wide sun", under_sun}};
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const Rival& rival : rivals) {
    const SceneBuilder on = rival.scene(7), off = rival.scene(-1);
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr("shared")) << rival.name;
    ASSERT_THAT(estimate(off, 2).variant, testing::Not(testing::HasSubstr("shared")));
    const Quarters a = quarters_of(on, 8, kSeeds, 100), b = quarters_of(off, 16, kSeeds, 900);
    double least = 1;
    for (std::size_t q = 0; q < kQuarters; ++q) {
      const double error = std::sqrt(a.variance[q] + b.variance[q]);
      // Student's test with the freedom of one of the two alone: that of both together is larger
      EXPECT_LT(std::abs(a.mean[q] - b.mean[q]), cli::student_quantile(level, kSeeds - 1) * error)
          << rival.name << ", quarter and channel " << q << ": " << a.mean[q] << " and " << b.mean[q];
      least = std::min(least, error / b.mean[q]);
    }
    std::printf("%s: +- %.2g %%\n", rival.name, 100 * least);
    EXPECT_LT(least, .03) << rival.name << ": the test has no power";
  }
  tests.close();
}

}  // namespace
}  // namespace ls::test
