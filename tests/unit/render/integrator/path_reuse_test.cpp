// Tests in which scenes pixels share paths, that sharing reduces noise, and that pixels do not depend on
// seeds, crops, threads or variants. tests/property/path_reuse_test.cpp tests that sharing does not change
// the image.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/lamp_room.h"
#include "tests/support/render_check.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

using test::operator*;
using test::LampRoom;
using test::SceneBuilder;

bool shares(const SceneBuilder& b) {
  return describe(*test::world_of(b)).variant.find("shared") != std::string::npos;
}
SceneBuilder changed(auto&& change, LampRoom room = {.fog = .5, .path_reuse = 8}) {
  SceneBuilder b = room.builder();
  change(b);
  return b;
}

TEST(PathReuse, IsUsedIfRequestedAndPossible) {
  EXPECT_TRUE(shares(LampRoom{.path_reuse = 8}.builder()));
  EXPECT_TRUE(shares(LampRoom{.glossy = true, .fog = .5, .chromatic = true, .path_reuse = 2}.builder()));
  EXPECT_FALSE(shares(LampRoom{}.builder()));
  EXPECT_TRUE(shares(changed([](SceneBuilder& b) { b.scene.integrator.name = "path"; })));
  EXPECT_FALSE(shares(changed([](SceneBuilder& b) { b.scene.integrator.name = "volpath_distant_mis"; })));
  EXPECT_FALSE(shares(LampRoom{.path_reuse = 8, .max_depth = 2}.builder())) << "direct light alone";
  EXPECT_FALSE(shares(changed([](SceneBuilder& b) { b.scene.integrator.rr_depth = 1; })));
  EXPECT_FALSE(shares(changed([](SceneBuilder& b) {
    b.scene.emitters.push_back(PointEmitter{{0, .5, 0}, {1, 1, 1}});
  }))) << "directions are aimed at a lamp in a medium";
  const auto add_sun = [](SceneBuilder& b, double radius) {
    b.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, {1, 1, 1}, radius});
  };
  EXPECT_TRUE(shares(changed([&](SceneBuilder& b) { add_sun(b, 0); })));
  EXPECT_TRUE(shares(changed([&](SceneBuilder& b) { add_sun(b, 3); })));
  EXPECT_FALSE(shares(changed([&](SceneBuilder& b) {
    add_sun(b, 3);
    add_sun(b, 4);
  }))) << "two lights that paths can hit in the same direction";
  const auto add_mask = [](SceneBuilder& b) -> Shape& {
    return b.shape(RectangleShape{}, test::scale(.1),
                   b.bsdf(MaskBsdf{b.texture({.5, .5, .5}), b.diffuse(.5)}));
  };
  EXPECT_TRUE(shares(changed([&](SceneBuilder& b) { add_mask(b); })));
  EXPECT_TRUE(shares(changed([&](SceneBuilder& b) {
    add_mask(b);
    b.scene.integrator.name = "path";
  })));
  EXPECT_TRUE(shares(changed([](SceneBuilder& b) { add_sky(b, test::SkyImage(4, 3, 1)); })));
  EXPECT_FALSE(shares(changed([&](SceneBuilder& b) {
    add_sky(b, test::SkyImage(4, 3, 1));
    add_sun(b, 3);
  }))) << "two lights that paths can hit in the same direction";
  EXPECT_FALSE(shares(changed([&](SceneBuilder& b) {
    add_mask(b).emitter = AreaEmitter{b.texture({1, 1, 1})};
  }))) << "a path may pass several lights";
  EXPECT_FALSE(shares(changed([](SceneBuilder& b) {
    b.container(RectangleShape{}, test::scale(.1), b.null(), MediumIndex{0});
  }))) << "an open boundary";
}

// A lamp above a grey floor in the open: nearly all light is scattered once.
SceneBuilder open_floor() {
  SceneBuilder b;
  b.scene.integrator.path_reuse = 0;
  b.look({0, 2, 4}, {0, 0, 0}, 50, {0, 1, 0});
  b.shape(RectangleShape{}, test::rotate_x(-90) * test::scale(4), b.diffuse(.3));
  b.shape(SphereShape{{0, .5, 0}, .5}, {}, b.diffuse(.3));
  b.shape(RectangleShape{}, test::translate({.2, 3, -.1}) * test::rotate_x(90) * test::scale(.5),
          b.diffuse(.3))
      .emitter = AreaEmitter{b.texture({18, 15, 11})};
  return b;
}

// A glass ball between a lamp and the floor: the noise comes from the caustic, which paths find behind delta
// lobes.
SceneBuilder caustic() {
  SceneBuilder b;
  b.scene.integrator.path_reuse = 0;
  b.look({0, 2, 4}, {0, 0, 0}, 50, {0, 1, 0});
  b.shape(RectangleShape{}, test::rotate_x(-90) * test::scale(4), b.diffuse(.3));
  b.shape(SphereShape{{0, .8, 0}, .6}, {}, b.glass(1.5));
  b.shape(RectangleShape{}, test::translate({0, 3, 0}) * test::rotate_x(90) * test::scale(.5), b.diffuse(.3))
      .emitter = AreaEmitter{b.texture({18, 15, 11})};
  return b;
}

TEST(PathReuse, IsOnByDefaultWhereMultipleScatteringCausesTheNoise) {
  EXPECT_TRUE(shares(LampRoom{.path_reuse = 0}.builder({64, 64})));
  EXPECT_TRUE(shares(LampRoom{.fog = .5, .path_reuse = 0}.builder()));
  EXPECT_FALSE(shares(open_floor()));
  EXPECT_FALSE(shares(caustic()));
  EXPECT_FALSE(shares(LampRoom{.fog = .5, .path_reuse = 0}.builder({15, 17}))) << "too few pixels";
}

// A denoiser takes means over the pixels that would share, so an image with its guides shares only if asked
// to.
TEST(PathReuse, IsLeftOutByDefaultWhereTheImageIsMadeForADenoiser) {
  const auto world = [](int path_reuse, std::vector<std::string> aov) {
    const SceneBuilder b = LampRoom{.fog = .5, .path_reuse = path_reuse}.builder();
    RenderSettings settings = test::settings_of(b.scene);
    settings.aov = std::move(aov);
    auto w = build_world(b.scene, settings, b.files, 1);
    if (!w) throw std::runtime_error(w.error().message);
    return *w;
  };
  EXPECT_GT(world(0, {"depth"})->reuse, 0);
  EXPECT_EQ(world(0, {"denoising_albedo"})->reuse, 0);
  EXPECT_EQ(world(0, {"depth", "denoising_albedo", "denoising_normal"})->reuse, 0);
  EXPECT_EQ(world(8, {"denoising_albedo", "denoising_normal"})->reuse, 8);
}

std::vector<float> tile(const World& w, PixelRect rect, SampleRange samples) {
  return render_tile(w, rect, samples, nullptr, nullptr).sums;
}
// Returns those of the sums of `all` that belong to its part `rect`.
std::vector<float> part(const std::vector<float>& sums, PixelRect all, PixelRect rect) {
  std::vector<float> out;
  const auto pixels = static_cast<std::size_t>(all.pixels());
  for (std::size_t p = 0; p < sums.size() / pixels; ++p)
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x)
        out.push_back(sums[p * pixels + static_cast<std::size_t>((y - all.y0) * all.width() + x - all.x0)]);
  return out;
}

// In the integrator `path`, passed surfaces count towards the maximum depth. A null box stands in front of
// the left half of the picture. A lamp that shines upwards lights the ceiling only, and the ceiling lights
// the floor. Behind the box the floor stays black, since paths that passed the box may not go on to the
// ceiling.
TEST(PathReuse, LooksOnlyAtSecondVerticesThatItsOwnPathCouldReach) {
  SceneBuilder b({16, 16});
  b.scene.integrator.name = "path";
  b.scene.integrator.max_depth = 4;
  b.scene.integrator.path_reuse = 16;
  b.look({0, .5, 3}, {0, -1, .5}, 40, {0, 1, 0});
  b.shape(RectangleShape{}, test::translate({0, -1, 0}) * test::rotate_x(-90) * test::scale(5),
          b.diffuse(.7));
  b.shape(RectangleShape{}, test::translate({0, 3, 0}) * test::rotate_x(90) * test::scale(5), b.diffuse(.7));
  b.shape(RectangleShape{}, test::translate({0, 2, 0}) * test::rotate_x(-90), b.diffuse(0)).emitter =
      AreaEmitter{b.texture({9, 9, 9})};
  b.shape(CubeShape{}, test::translate({-1, .3, 2.5}) * test::scale(1, 1, .1), b.null());
  ASSERT_TRUE(shares(b));
  const auto sums = tile(*test::world_of(b), {0, 0, 16, 16}, {0, 32});
  for (std::size_t p = 0; p < 256; ++p)
    if (p % 16 < 7)
      EXPECT_EQ(sums[p], 0) << p;
    else if (p % 16 > 8)
      EXPECT_GT(sums[p], 0) << p;
}

TEST(PathReuse, GivesTheSamePixelsInEveryTileCropAndSampleRange) {
  constexpr SampleRange kSamples{2, 6};
  constexpr PixelRect kAll{0, 0, 37, 20};
  const LampRoom room{.fog = .5, .path_reuse = 6};
  const auto world = test::world_of(room.builder({37, 20}));
  const std::vector<float> whole = tile(*world, kAll, kSamples);
  for (const PixelRect rect : {PixelRect{3, 2, 20, 19}, PixelRect{16, 0, 17, 1}, PixelRect{30, 15, 37, 20}})
    EXPECT_EQ(tile(*world, rect, kSamples), part(whole, kAll, rect)) << show(rect);

  SceneBuilder cropped = room.builder({37, 20});
  cropped.scene.film.crop_offset = {5, 3};
  cropped.scene.film.crop_size = {20, 11};
  const auto crop = test::world_of(cropped);
  EXPECT_EQ(tile(*crop, {0, 0, 20, 11}, kSamples), part(whole, kAll, {5, 3, 25, 14}));

  double sum = 0;
  for (std::uint64_t s = kSamples.s0; s < kSamples.s1; s += 2) sum += render_sample(*world, 18, 17, s).rgb[1];
  EXPECT_FLOAT_EQ(static_cast<float>(sum), part(whole, kAll, {18, 17, 19, 18})[1]);
}

// Whether sharing pays depends neither on the job's seed nor on a crop, and the pilot leaves the world
// unchanged.
TEST(PathReuse, DefaultEqualsTheExplicitSetting) {
  constexpr PixelRect kAll{0, 0, 16, 16};
  for (const std::uint64_t seed : {0, 1, 2}) {
    const auto sums = [&](LampRoom room) {
      return tile(*test::world_of(room.builder(), seed), kAll, {0, 2});
    };
    EXPECT_EQ(sums({.fog = .5, .path_reuse = 0}), sums({.fog = .5, .path_reuse = 16})) << seed;
  }
  SceneBuilder cropped = LampRoom{.fog = .5, .path_reuse = 0}.builder();
  cropped.scene.film.crop_offset = {5, 3};
  cropped.scene.film.crop_size = {2, 1};
  const auto whole = tile(*test::world_of(LampRoom{.fog = .5, .path_reuse = 16}.builder()), kAll, {0, 2});
  EXPECT_EQ(tile(*test::world_of(cropped), {0, 0, 2, 1}, {0, 2}), part(whole, kAll, {5, 3, 7, 4}));
}

// The decision does not depend on the pilot's number of threads. Frames of this size have 64 groups.
TEST(PathReuse, DecisionIsTheSameForAnyNumberOfThreads) {
  for (SceneBuilder b : {LampRoom{.path_reuse = 0}.builder(), open_floor(), caustic()}) {
    b.scene.film.size = {256, 256};
    for (const int threads : {2, 3, 16})
      EXPECT_EQ(test::world_of(b, 0, threads)->reuse, test::world_of(b)->reuse) << threads;
  }
}

TEST(PathReuse, GivesTheSameBitsInEveryVariant) {
  const auto veiled = [](SceneBuilder& b) {
    b.shape(RectangleShape{}, test::scale(.5), b.bsdf(MaskBsdf{b.texture({.5, .5, .5}), b.diffuse(.5)}));
    add_sky(b, test::SkyImage(4, 3, 1));
  };
  for (const SceneBuilder& b :
       {LampRoom{.glossy = true, .path_reuse = 5}.builder(), LampRoom{.fog = .5, .path_reuse = 5}.builder(),
        LampRoom{.fog = .5, .chromatic = true, .path_reuse = 5}.builder(), changed(veiled, {.path_reuse = 5}),
        changed(veiled)}) {
    const auto world = test::world_of(b);
    const auto names = covering_variants(*world);
    ASSERT_GE(names.size(), 2u);
    const auto first = render_tile_as(*world, names[0], {0, 0, 16, 16}, {0, 4}).sums;
    for (const std::string& name : names) {
      auto sums = render_tile_as(*world, name, {0, 0, 16, 16}, {0, 4}).sums;
      sums.resize(first.size());  // without light components
      EXPECT_EQ(sums, first) << name;
    }
  }
}

// The test prints the ratios of the squared errors: 0.58 without fog and 0.29 with it. A square in which
// pixels share is a quarter of this small image. The limit of three quarters leaves room for other sequences
// of random numbers.
TEST(PathReuse, ReducesNoiseOfIndirectLight) {
  for (const double fog : {0., .8}) {
    const auto squared_error = [&](int path_reuse) {
      // The sum of the pixels' squared errors, which may depend on each other
      const auto e = test::estimate(LampRoom{.fog = fog, .path_reuse = path_reuse}.builder({32, 32}), 16);
      return e.standard_error[1] * e.standard_error[1];
    };
    const double with = squared_error(16), without = squared_error(-1);
    std::printf("fog %g: %.3f\n", fog, with / without);
    EXPECT_LT(with, .75 * without) << fog;
  }
}

}  // namespace
}  // namespace ls::render
