// Paths that serve several pixels bring the same image as paths that serve one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "tests/property/quarters.h"
#include "tests/support/coloured_phase.h"
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

// A room whose floor is black in squares, with black fog or none, and long paths that roulette ends early:
// where a first vertex is black its path ends, and brings its group nothing.
SceneBuilder black_squares(double fog, int path_reuse) {
  SceneBuilder b = LampRoom{.fog = fog, .path_reuse = path_reuse, .max_depth = -1}.builder();
  b.scene.integrator.rr_depth = 2;
  CheckerboardTexture squares{b.texture({0, 0, 0}), b.texture({.9, .9, .9})};
  squares.to_uv = UvTransform{{3, 0, 0, 0, 3, 0}};
  const auto checker = SceneBuilder::push<TextureTag>(b.scene.textures, squares);
  const BsdfIndex side = b.bsdf(DiffuseBsdf{checker});
  b.shape(RectangleShape{}, translate({0, -.97, 0}) * rotate_x(90), b.bsdf(TwoSidedBsdf{side, side}));
  if (fog > 0) std::get<HomogeneousMedium>(b.scene.media[0]).albedo = {.9, .5, 0};
  return b;
}

// A room with two sheets that let a part of the light pass straight on: one diffuse, of which both sides have
// first and second vertices, and one of strongly coloured glass, of the room's size.
SceneBuilder sheets(LampRoom room, int path_reuse) {
  room.path_reuse = path_reuse;
  SceneBuilder b = room.builder();
  const BsdfIndex red = b.bsdf(DiffuseBsdf{b.texture({.8, .4, .3})});
  b.shape(RectangleShape{}, translate({0, -.3, -.2}) * rotate_y(60) * scale(.7),
          b.bsdf(MaskBsdf{b.texture({.4, .4, .4}), b.bsdf(TwoSidedBsdf{red, red})}));
  b.shape(RectangleShape{}, translate({0, 0, .1}) * rotate_x(20) * scale(.9),
          b.bsdf(ThinDielectricBsdf{1.5, 1, b.texture({1, 1, 1}), b.texture({.9, .1, .3})}));
  return b;
}
// A floor below a sheet that is half glass and half paper, above which a lamp shines upwards on a plate: what
// the paper scatters is all the light that comes by second vertices.
SceneBuilder paper_ceiling(int path_reuse) {
  SceneBuilder b({16, 16});
  b.scene.integrator.max_depth = 3;
  b.scene.integrator.path_reuse = path_reuse;
  b.look({0, .3, 2.5}, {0, -.6, 0}, 40, {0, 1, 0});
  const TextureIndex white = b.texture({1, 1, 1});
  b.shape(RectangleShape{}, translate({0, -1, 0}) * rotate_x(-90) * scale(3), b.diffuse(.7));
  const BsdfIndex pane = b.bsdf(ThinDielectricBsdf{1.5, 1, white, white}),
                  paper = b.bsdf(DiffuseTransmissionBsdf{b.texture({.2, .2, .2}), b.texture({.7, .7, .7})});
  b.shape(RectangleShape{}, translate({0, .5, 0}) * rotate_x(90) * scale(3),
          b.bsdf(BlendBsdf{b.texture({.5, .5, .5}), pane, paper}));
  b.shape(DiskShape{}, translate({0, .52, 0}) * rotate_x(90) * scale(.8),
          b.bsdf(TwoSidedBsdf{b.diffuse(0), b.diffuse(0)}));
  b.shape(RectangleShape{}, translate({0, 1, 0}) * rotate_x(90) * scale(.25), b.diffuse(0)).emitter =
      AreaEmitter{b.texture({20, 20, 20})};
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
SceneBuilder in_chromatic_fog(SceneBuilder b) {
  b.scene.integrator.camera_points = b.scene.integrator.light_vertices = -1;
  b.scene.sensor.medium = b.homogeneous({.1, .3, .2}, {.9, .8, .7}, .3);
  b.container(CubeShape{}, scale(9), b.null(), *b.scene.sensor.medium);
  return b;
}

TEST(PathReuse, GivesTheSameImageAsPathsAlone) {
  constexpr int kSeeds = 24;
  Tests tests("property/path_reuse");
  struct Rival {
    const char* name;
    std::function<SceneBuilder(int path_reuse)> scene;
    std::uint64_t spp = 8;
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
      {"fog that scatters colours apart",
       [](int n) { return with_coloured_phase(LampRoom{.fog = .8, .path_reuse = n}.builder()); }},
      {"black squares", [](int n) { return black_squares(0, n); }},
      {"black squares in fog", [](int n) { return black_squares(.5, n); }},
      {"glossy in fog", room({.glossy = true, .fog = .4})},
      {"chromatic fog", room({.fog = 1, .chromatic = true})},
      {"mirrors", mirrors},
      {"leaf", leaf},
      {"sheets", [](int n) { return sheets({}, n); }},
      {"sheets in chromatic fog", [](int n) { return sheets({.fog = .6, .chromatic = true}, n); }, 16},
      {"counted sheets", counted_sheets},
      {"sky", under_sky},
      {"sky with an image", under_sky_image},
      {"wide sun", under_sun},
      {"paper ceiling", paper_ceiling, 32},
      {"sky with an image in fog", [](int n) { return in_chromatic_fog(under_sky_image(n)); }},
      {"wide sun in fog", [](int n) { return in_chromatic_fog(under_sun(n)); }}};
  const double level = tests.level(std::size(rivals) * kQuarters);
  for (const Rival& rival : rivals) {
    const SceneBuilder on = rival.scene(7), off = rival.scene(-1);
    ASSERT_THAT(estimate(on, 2).variant, testing::HasSubstr("shared")) << rival.name;
    ASSERT_THAT(estimate(off, 2).variant, testing::Not(testing::HasSubstr("shared")));
    expect_same_quarters(rival.name, level, quarters_of(on, rival.spp, kSeeds, 100),
                         quarters_of(off, 2 * rival.spp, kSeeds, 900), kSeeds);
  }
  tests.close();
}

TEST(PathReuse, KeepsTheExpectedImageToHalfAPercent) {
  constexpr int kSeeds = 48;
  Tests tests("property/path_reuse_mean");
  const SceneBuilder on = LampRoom{.path_reuse = 8}.builder(), off = LampRoom{.path_reuse = -1}.builder();
  const double tolerance =
      expect_same_quarters("lamp room", tests.level(kQuarters), quarters_of(on, 64, kSeeds, 3000),
                           quarters_of(off, 64, kSeeds, 4000), kSeeds);
  EXPECT_LT(tolerance, kBiasSeen) << "the test has no power";
  tests.close();
}

}  // namespace
}  // namespace ls::test
